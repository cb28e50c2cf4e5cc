"""Rerun recordings: the file, entities below a path of it, and a robot in it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
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

    Rerun keeps threads and buffers of every recording until the program ends, unless it is told to let go of those that
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
    """What `stream.send_blueprint(blueprint)` does, but the blueprint's own stream is closed after it.

    Rerun's keeps that stream, two threads, for good: its memory refers to it, and it to its memory (rerun-sdk 0.41.0).
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
