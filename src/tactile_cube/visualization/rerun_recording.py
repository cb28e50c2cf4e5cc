"""Rerun recordings: the file, entities below a path of it, a robot in it, the views and the viewer that show it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings
from rerun.urdf import UrdfTree

from tactile_cube.evaluation.episode_record import Array
from tactile_cube.whole_file import write_whole

LEGEND = rrb.PlotLegend(corner="LeftTop")
EYE = rrb.EyeControls3D(position=(0.23, -0.26, -0.01), look_target=(0.0, 0.0, 0.06), eye_up=(0, 0, 1))
BACKGROUND = rrb.Background(color=(247, 248, 250))


def episode_blueprint(
    fingers: Sequence[str], hand_name: str, names: Mapping[str, str], curves: bool = False
) -> rrb.Blueprint:
    """Return the layout of episodes side by side, with the learning curves of their run.

    Args:
        fingers: names of the hand's fingers.
        hand_name: of the robot in the hand's URDF.
        names: path below which each episode was written, "" or e.g. "best" -> its name.
        curves: whether there is a picture of learning curves at "curves".
    """
    sides = []
    for root, name in names.items():

        def curve(name: str, origin: str, *entities: str, root: str = f"/{root}".rstrip("/")) -> rrb.View:
            contents = [f"{root}/{entity}" for entity in entities] or "$origin/**"
            return rrb.TimeSeriesView(
                name=name, origin=f"{root}/{origin}".rstrip("/") or "/", contents=contents, plot_legend=LEGEND
            )

        scene, theta = _scene(root, name, hand_name), curve("theta [rad]", "task/theta")
        task = [curve("reward terms", "task/reward"), curve("forces [N]", "task/force")]
        task += [rrb.TextDocumentView(name="Episode", origin=f"/{root}/episode".replace("//", "/"))]
        joints = [_finger_views(finger, curve) for finger in fingers]
        if not root:  # it has the window to itself
            left = rrb.Vertical(scene, theta, row_shares=[4, 1])
            right = rrb.Vertical(rrb.Tabs(*task), rrb.Tabs(*joints), row_shares=[2, 3])
            return whole(rrb.Horizontal(left, right, column_shares=[5, 4]))
        sides.append(rrb.Vertical(scene, rrb.Tabs(theta, *task, *joints), row_shares=[3, 2]))
    episodes = rrb.Horizontal(*sides)
    if not curves:
        return whole(episodes)
    learning = rrb.Spatial2DView(name="Learning curves", origin="/curves", background=(255, 255, 255))
    words = rrb.TextDocumentView(name="Run", origin="/run")
    return whole(rrb.Horizontal(episodes, rrb.Vertical(learning, words), column_shares=[5, 2]))


def _scene(root: str, name: str, hand_name: str) -> rrb.View:
    """Show hand, object, contact forces and trail of an episode in 3D."""
    hand = f"/{root}_hand" if root else "/hand"  # as Branch.hand
    parts = [hand, *(f"/{root}/{part}".replace("//", "/") for part in ("cube", "contacts", "trail"))]
    return rrb.Spatial3DView(
        name=name,
        origin=f"/{root}",
        # Rerun's URDF importer logs collision shapes beside the visual ones; seen together they flicker.
        contents=[*(f"{part}/**" for part in parts), f"- {hand}/{hand_name}/collision_geometries/**"],
        eye_controls=EYE,
        background=BACKGROUND,
        line_grid=False,
    )


def _finger_views(finger: str, curve: Callable[..., rrb.View]) -> rrb.Container:
    """Make a finger's views: the policy's input, the path of its action, the drives."""
    joints, policy = f"joints/{finger}", f"policy/{finger}"
    gets = [curve(f"{finger}: {name} as the policy gets it [rad]", f"{policy}/{name}") for name in ("q_m", "e_q")]
    action = [
        curve(f"{finger}: action asked for, target q_n [rad]", "", f"{policy}/action", f"{joints}/q_n"),
        curve(f"{finger}: filtered q_f, limited q_d [rad]", "", f"{joints}/q_f", f"{joints}/q_d"),
    ]
    drive = [
        curve(f"{finger}: q_d, q_m, q [rad]", "", *(f"{joints}/{name}" for name in ("q", "q_m", "q_d"))),
        curve(f"{finger}: torque [N m]", f"{joints}/torque"),
    ]
    tabs = {"policy gets": gets, "action, filter, limits": action, "drives at 500 Hz": drive}
    return rrb.Tabs(*(rrb.Vertical(*views, name=name) for name, views in tabs.items()), name=finger)


def whole(views: rrb.Container) -> rrb.Blueprint:
    """Return a layout with the time line of episodes and without the viewer's own panels."""
    return rrb.Blueprint(
        views,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
    )


VIEWERS = ("auto", "window", "none")


def show_files(files: Sequence[Path], wanted: str) -> str:
    """Open recordings in a window; says in words where they are to be seen.

    The window outlives the program, and Ctrl-C does not reach it.

    Args:
        files: recordings, `.rrd`.
        wanted: "window", "none", or "auto": a window where there is a display, else none.
    """
    display = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if wanted == "none" or (wanted == "auto" and not display):
        return f"to look at it: rerun {' '.join(map(str, files))} (in a browser: --web-viewer --bind 127.0.0.1)"
    words = [sys.executable, "-m", "rerun", "--bind", "127.0.0.1"]  # else it would be open to the whole network
    silent = subprocess.DEVNULL
    subprocess.Popen([*words, *map(str, files)], stdin=silent, stdout=silent, stderr=silent, start_new_session=True)
    return "opening the Rerun viewer"


APPLICATION = "tactile_cube"
TIMELINE = "time"
SHAPES: dict[str, Any] = {"box": rr.Boxes3D, "cylinder": rr.Cylinders3D, "sphere": rr.Ellipsoids3D}
Colours = Sequence[tuple[int, ...]]


@dataclass(frozen=True)
class Branch:
    """Where an episode is written.

    Attributes:
        stream: the recording.
        root: path that all entities stand below, "" or e.g. "best/".
    """

    stream: rr.RecordingStream
    root: str = ""

    @property
    def hand(self) -> Branch:
        """Where its hand is written: Rerun's URDF importer takes one name, no path."""
        return replace(self, root=f"{self.root.replace('/', '_')}hand/")

    def log(self, entity: str, archetype: Any, time: float = 0.0) -> None:
        """Write what holds from `time` [s] of the episode on."""
        self.stream.set_time(TIMELINE, duration=time)
        self.stream.log(self.root + entity, archetype)
        self.stream.reset_time()

    def always(self, entity: str, archetype: Any) -> None:
        """Write what holds for the whole recording."""
        self.stream.log(self.root + entity, archetype, static=True)

    def columns(self, entity: str, time: Array, columns: Iterable[Any]) -> None:
        """Write values at times `(n,)` [s] of the episode in one piece."""
        self.stream.send_columns(self.root + entity, [rr.TimeColumn(TIMELINE, duration=time)], columns)

    def lines(self, entity: str, time: Array, values: Array, names: list[str], colours: Colours | None = None) -> None:
        """Write curves: values `(n,)` or `(n, lines)`."""
        self.always(entity, rr.SeriesLines(names=names, colors=colours))
        self.columns(entity, time, rr.Scalars.columns(scalars=values))


@contextmanager
def recording_file(
    path: Path, blueprint: rrb.Blueprint, application: str = APPLICATION
) -> Iterator[rr.RecordingStream]:
    """Write a recording; open it with `rerun FILE.rrd`.

    Rerun keeps threads and buffers of every recording until the program ends, unless it is made to release those that
    nothing refers to any more, which happens here to those of earlier files.

    Args:
        path: file to write, `.rrd`.
        blueprint: how the viewer arranges it.
        application: recordings of one application share their arrangement in the viewer.
    """
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
    stream = rr.RecordingStream(application, recording_id=path.stem)
    written = rr.binary_stream(stream)  # a file of Rerun's own would be cut short by a full disk
    _arrange(stream, blueprint, application)
    try:
        yield stream
        write_whole(path, written.read() or b"")
    finally:
        stream.disconnect()


def _arrange(stream: rr.RecordingStream, blueprint: rrb.Blueprint, application: str) -> None:
    """Send a blueprint as `stream.send_blueprint(blueprint)` does, then close the blueprint's own stream.

    Rerun's never frees that stream and its two threads: stream and memory refer to each other (rerun-sdk 0.41.0).
    """
    native = rerun_bindings.new_blueprint(
        application_id=application, make_default=False, make_thread_default=False, default_enabled=True
    )
    layout = rr.RecordingStream._from_native(native)
    layout.set_time("blueprint", sequence=0)
    blueprint._log_to_stream(layout)
    arranged = layout.memory_recording().storage
    rerun_bindings.send_blueprint(arranged, make_active=False, make_default=True, recording=stream.to_native())
    layout.disconnect()


def log_robot(stream: rr.RecordingStream, urdf: str, path: str, frame_prefix: str | None = None) -> UrdfTree:
    """Write a robot's links below a path, boxes, cylinders and spheres as solid bodies.

    Args:
        stream: the recording.
        urdf: text of its URDF.
        path: of the entities, without a slash at its end.
        frame_prefix: put before the names of its frames.

    Returns:
        The robot, whose joints turn angles into transforms.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(urdf, encoding="utf-8")
        static = f"{path}/static"
        tree = UrdfTree.from_file_path(
            file, entity_path_prefix=path, frame_prefix=frame_prefix, static_transform_entity_path=static
        )
        tree.log_urdf_to_recording(stream)
    _fill_shapes(stream, tree, urdf)
    return tree


def _fill_shapes(stream: rr.RecordingStream, tree: UrdfTree, urdf: str) -> None:
    """Draw the links solid; the importer draws cylinders, spheres and boxes as translucent wire frames."""
    for link in ElementTree.fromstring(urdf).iter("link"):
        paths = tree.get_visual_geometry_paths(str(link.get("name")))
        for path, visual in zip(paths, link.findall("visual"), strict=True):
            for tag, archetype in SHAPES.items():
                if visual.find(f"geometry/{tag}") is not None:
                    stream.log(path, archetype.from_fields(fill_mode="solid"), static=True)
