"""A part of a Rerun recording: entities below one path, from one point in time on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import rerun as rr

from tactile_cube.evaluation.episode_record import Array

TIMELINE = "time"
Colours = Sequence[tuple[int, ...]]


@dataclass(frozen=True)
class Branch:
    """Where an episode is written.

    Attributes:
        stream: the recording.
        root: path that all entities stand below, "" or e.g. "best/".
        start: when the episode begins on the time line [s].
        stride: every how many samples of the physics rate are written.
    """

    stream: rr.RecordingStream
    root: str = ""
    start: float = 0.0
    stride: int = 1

    @property
    def hand(self) -> Branch:
        """Where its hand is written: Rerun's URDF importer takes one name, no path."""
        return replace(self, root=f"{self.root.replace('/', '_')}hand/")

    def log(self, entity: str, archetype: Any, time: float = 0.0) -> None:
        """Write what holds from `time` [s] of the episode on."""
        self.stream.set_time(TIMELINE, duration=self.start + time)
        self.stream.log(self.root + entity, archetype)
        self.stream.reset_time()

    def always(self, entity: str, archetype: Any) -> None:
        """Write what holds for the whole recording."""
        self.stream.log(self.root + entity, archetype, static=True)

    def columns(self, entity: str, time: Array, columns: Iterable[Any]) -> None:
        """Write values at times `(n,)` [s] of the episode in one piece."""
        self.stream.send_columns(self.root + entity, [rr.TimeColumn(TIMELINE, duration=self.start + time)], columns)

    def lines(self, entity: str, time: Array, values: Array, names: list[str], colours: Colours | None = None) -> None:
        """Write curves: values `(n,)` or `(n, lines)`."""
        self.always(entity, rr.SeriesLines(names=names, colors=colours))
        self.columns(entity, time, rr.Scalars.columns(scalars=values))
