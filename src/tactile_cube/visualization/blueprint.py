"""Which views open when a recorded episode is opened in the Rerun viewer."""

from __future__ import annotations

from collections.abc import Sequence

import rerun.blueprint as rrb

TIMELINE = "time"
LEGEND = rrb.PlotLegend(corner="LeftTop")


def episode_blueprint(fingers: Sequence[str], hand_name: str) -> rrb.Blueprint:
    """Return the layout: the hand in 3D on the left, the task's signals and the 500 Hz joint signals on the right.

    Args:
        fingers: names of the hand's fingers.
        hand_name: of the robot in the hand's URDF.
    """
    # Rerun's URDF importer logs collision shapes beside the visual ones; seen together they flicker.
    collision_shapes = f"- /hand/{hand_name}/collision_geometries/**"
    hand = rrb.Spatial3DView(
        name="Hand and cube",
        origin="/",
        contents=["/hand/**", collision_shapes, "/cube/**", "/contacts/**", "/trail", "/support/**"],
        eye_controls=rrb.EyeControls3D(position=(0.30, -0.34, -0.10), look_target=(0.0, 0.0, 0.04), eye_up=(0, 0, 1)),
        line_grid=False,
    )
    task = rrb.Tabs(
        rrb.Vertical(
            rrb.TimeSeriesView(name="theta [rad]", origin="/task/theta"),
            rrb.TimeSeriesView(name="reward terms", origin="/task/reward", plot_legend=LEGEND),
            rrb.TimeSeriesView(name="normal force of each finger [N]", origin="/task/force", plot_legend=LEGEND),
        ),
        rrb.TimeSeriesView(name="curriculum: T_s [s], gravity", origin="/curriculum"),
        rrb.TextDocumentView(name="Episode", origin="/episode"),
    )
    joints = rrb.Tabs(*(_finger_view(finger) for finger in fingers), name="Joints at the physics rate")
    return rrb.Blueprint(
        rrb.Horizontal(hand, rrb.Vertical(task, joints), column_shares=[5, 4]),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
    )


def _finger_view(finger: str) -> rrb.Container:
    angles = rrb.TimeSeriesView(
        name=f"{finger}: q_d, q_m, q [rad]",
        origin=f"/joints/{finger}",
        contents=["$origin/q", "$origin/q_m", "$origin/q_d"],
    )
    action = rrb.TimeSeriesView(
        name=f"{finger}: action q_n, filtered q_f, limited q_d [rad]",
        origin=f"/joints/{finger}",
        contents=["$origin/q_n", "$origin/q_f", "$origin/q_d"],
    )
    torques = rrb.TimeSeriesView(name=f"{finger}: torque [N m]", origin=f"/joints/{finger}/torque")
    drive = rrb.Vertical(angles, torques, name="drive")
    return rrb.Tabs(drive, action, _reading_view(finger), name=finger)


def _reading_view(finger: str) -> rrb.Container:
    views = (
        rrb.TimeSeriesView(name=f"{finger}: {name} as the policy gets it [rad]", origin=f"/policy/{finger}/{name}")
        for name in ("q_m", "e_q")
    )
    return rrb.Vertical(*views, name="what the policy gets")
