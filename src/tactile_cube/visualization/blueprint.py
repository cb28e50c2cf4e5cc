"""Which views open when recorded episodes are opened in the Rerun viewer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from tactile_cube.visualization.rerun_recording import TIMELINE

LEGEND = rrb.PlotLegend(corner="LeftTop")
EYE = rrb.EyeControls3D(position=(0.23, -0.26, -0.01), look_target=(0.0, 0.0, 0.06), eye_up=(0, 0, 1))
BACKGROUND = rrb.Background(color=(247, 248, 250))


@dataclass(frozen=True)
class EpisodeViews:
    """The views of one episode.

    Attributes:
        hand_name: of the robot in the hand's URDF.
        root: path below which the episode was written, "/" or e.g. "/best".
    """

    hand_name: str
    root: str = "/"

    def scene(self, name: str = "Hand and cube") -> rrb.View:
        """Hand, object, contact forces and trail in 3D."""
        # Rerun's URDF importer logs collision shapes beside the visual ones; seen together they flicker.
        hand = f"/{self.root.strip('/')}_hand" if self.root.strip("/") else "/hand"  # as Branch.hand
        collision_shapes = f"- {hand}/{self.hand_name}/collision_geometries/**"
        parts = (f"{part}/**" for part in (hand, *(self._at(name) for name in ("cube", "contacts", "trail"))))
        return rrb.Spatial3DView(
            name=name,
            origin=self.root,
            contents=[*parts, collision_shapes],
            eye_controls=EYE,
            background=BACKGROUND,
            line_grid=False,
        )

    def theta(self) -> rrb.View:
        """How far the object was turned."""
        return rrb.TimeSeriesView(name="theta [rad]", origin=self._at("task/theta"))

    def task(self) -> list[rrb.View]:
        """Rewards, forces, and the episode in words."""
        return [
            self._curves("reward terms", "task/reward"),
            self._curves("forces [N]", "task/force"),
            rrb.TextDocumentView(name="Episode", origin=self._at("episode")),
        ]

    def finger(self, finger: str) -> rrb.Container:
        """What the policy gets of a finger, what becomes of its action, what the drives do."""
        joints, policy = f"joints/{finger}", f"policy/{finger}"
        gets = rrb.Vertical(
            self._curves(f"{finger}: q_m as the policy gets it [rad]", f"{policy}/q_m"),
            self._curves(f"{finger}: e_q as the policy gets it [rad]", f"{policy}/e_q"),
            name="policy gets",
        )
        action = rrb.Vertical(
            self._curves(f"{finger}: action asked for, target q_n [rad]", "", f"{policy}/action", f"{joints}/q_n"),
            self._curves(f"{finger}: filtered q_f, limited q_d [rad]", "", f"{joints}/q_f", f"{joints}/q_d"),
            name="action, filter, limits",
        )
        drive = rrb.Vertical(
            self._curves(f"{finger}: q_d, q_m, q [rad]", "", *(f"{joints}/{name}" for name in ("q", "q_m", "q_d"))),
            self._curves(f"{finger}: torque [N m]", f"{joints}/torque"),
            name="drives at 500 Hz",
        )
        return rrb.Tabs(gets, action, drive, name=finger)

    def _curves(self, name: str, origin: str, *entities: str) -> rrb.View:
        contents = [self._at(entity) for entity in entities] or "$origin/**"
        return rrb.TimeSeriesView(name=name, origin=self._at(origin), contents=contents, plot_legend=LEGEND)

    def _at(self, entity: str) -> str:
        return f"{self.root.rstrip('/')}/{entity}".rstrip("/") or "/"


def episode_blueprint(fingers: Sequence[str], hand_name: str) -> rrb.Blueprint:
    """Return the layout: the hand in 3D and theta on the left, the task's and the joints' signals on the right.

    Args:
        fingers: names of the hand's fingers.
        hand_name: of the robot in the hand's URDF.
    """
    views = EpisodeViews(hand_name)
    left = rrb.Vertical(views.scene(), views.theta(), row_shares=[4, 1])
    joints = rrb.Tabs(*(views.finger(finger) for finger in fingers))
    right = rrb.Vertical(rrb.Tabs(*views.task()), joints, row_shares=[2, 3])
    return whole(rrb.Horizontal(left, right, column_shares=[5, 4]))


def pair_blueprint(fingers: Sequence[str], hand_name: str, names: dict[str, str], curves: bool) -> rrb.Blueprint:
    """Return the layout of episodes side by side, with the learning curves of their run.

    Args:
        fingers: names of the hand's fingers.
        hand_name: of the robot in the hand's URDF.
        names: path below which each episode was written -> its name.
        curves: whether there is a picture of learning curves at "curves".
    """
    sides = []
    for root, name in names.items():
        views = EpisodeViews(hand_name, f"/{root}")
        signals = rrb.Tabs(views.theta(), *views.task(), *(views.finger(finger) for finger in fingers))
        sides.append(rrb.Vertical(views.scene(name), signals, row_shares=[3, 2]))
    episodes = rrb.Horizontal(*sides)
    if not curves:
        return whole(episodes)
    learning = rrb.Spatial2DView(name="Learning curves", origin="/curves", background=(255, 255, 255))
    words = rrb.TextDocumentView(name="Run", origin="/run")
    return whole(rrb.Horizontal(episodes, rrb.Vertical(learning, words), column_shares=[5, 2]))


def whole(views: rrb.Container) -> rrb.Blueprint:
    """A layout with the time line of episodes, and with nothing of the viewer's own panels."""
    return rrb.Blueprint(
        views,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
    )
