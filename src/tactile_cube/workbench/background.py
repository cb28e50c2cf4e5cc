"""`diagnose` in a process of its own, so that it can be watched and stopped at any time."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.fitting.intervals import Fitted
from tactile_cube.measurement.recordings.recording import Recording

BEST = "best so far: "
PHASES = (
    ("steps of simulation a sample", 0.05), ("base refitted", 0.15), ("starts of", 0.25), (BEST, 0.5),
    ("  held-out error", 0.75), ("verdict", 0.9),
)  # fmt: skip
"""What lines of a diagnosis begin with or contain, and which share of its time has gone by then, about."""


class Found(NamedTuple):
    """What a diagnosis answered.

    Attributes:
        text: in plain words.
        effects: what is missing, NAME@JOINT; of sets that do as well the first; where not all was found, that part.
        fitted: the model that it recommends.
        over_noise: error of its segments of untouched trials, in units of the sensor noise.
        left_out: whether it masked intervals of the trials, so that its errors are of fewer samples than others.
    """

    text: str
    effects: list[str]
    fitted: Fitted
    over_noise: float
    left_out: bool


@dataclass
class Progress:
    """How far a diagnosis is.

    Attributes:
        lines: everything that it said.
        share: done, about.
        best: best answer so far, in its words.
    """

    lines: list[str] = field(default_factory=list)
    share: float = 0.0
    best: str = ""
    began: float = field(default_factory=time.monotonic)

    def add(self, line: str) -> None:
        """Take a line."""
        self.lines = [*self.lines, line]
        reached = max((share for words, share in PHASES if words in line), default=0.0)
        self.share = max(self.share, reached)
        if line.startswith(BEST):
            self.best = line.removeprefix(BEST)
        elif line.startswith("base refitted: "):
            self.best = f"nothing yet; the refitted model leaves {line.rpartition('error ')[2]}"

    @property
    def left(self) -> float:
        """Seconds, about."""
        return (time.monotonic() - self.began) * (1.0 - self.share) / max(self.share, 0.01)


class Diagnosing:
    """A diagnosis that runs; `lines` waits for its progress, `stop` ends it, `found` is the answer."""

    def __init__(
        self, recording: Recording, model: ModelFile | None, own_effects: Sequence[str], seed: int, folder: Path
    ) -> None:
        """Start it.

        Args:
            recording: what was measured.
            model: to begin with; None: what the recording states.
            own_effects: dotted paths of the user's own classes.
            seed: which trials are held out.
            folder: where its files go.
        """
        self.found: Found | None = None
        self.progress = Progress()
        self.stopped = False
        context = multiprocessing.get_context("spawn")
        self._receiver, sender = context.Pipe(duplex=False)
        work = (recording, model, list(own_effects), seed, folder, sender)
        self._process = context.Process(target=_diagnose, args=work, daemon=True)
        self._process.start()
        sender.close()

    def lines(self) -> Iterator[str]:
        """Progress, line by line, until it ends.

        Raises:
            InputError: what `diagnose` raises, or the process died.
        """
        while True:
            try:
                said = self._receiver.recv()
            except (EOFError, OSError):
                break
            if isinstance(said, InputError):
                raise said
            if isinstance(said, Found):
                self.found = said
            else:
                self.progress.add(str(said))
                yield str(said)
        self._process.join()
        if self.found is None and not self.stopped:
            raise InputError(f"diagnose ended with status {self._process.exitcode}; the terminal says why")

    def wait(self) -> Found | None:
        """Return the answer when it has come; None: stopped."""
        for _ in self.lines():
            pass
        return self.found

    def stop(self) -> None:
        """End it at once."""
        self.stopped = True
        self._process.terminate()


def _end_with(parent: int) -> None:
    """End when the workbench does, however it ends."""
    wait([parent])
    os._exit(1)


def _diagnose(
    recording: Recording, model: ModelFile | None, effects: list[str], seed: int, folder: Path, sender: Connection
) -> None:
    from tactile_cube.api.diagnosis import diagnose

    parent = multiprocessing.parent_process()
    assert parent is not None, "this is a process of a workbench"
    Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()

    def say(line: str) -> None:
        sender.send(line)

    try:
        found = diagnose(recording, seed=seed, effects=effects, model=model, say=say)
        found.write(folder)
        assert found.free is not None  # a workbench has free motion
        fitted, known = found.free.fitted, found.free.known
        light = replace(fitted.fit, columns=np.zeros(0), residual=np.zeros(0))
        new = [term.label for term in fitted.model.terms if term.label not in known]
        over_noise = found.data["error_over_noise"]["with_effects"]
        sender.send(Found(found.text, new, replace(fitted, fit=light), over_noise, bool(found.data["left_out"])))
    except InputError as error:
        sender.send(error)
