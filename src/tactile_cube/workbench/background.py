"""`diagnose` in a process of its own, so that it can be watched and stopped at any time."""

import multiprocessing
import os
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.fitting.resolution import Fitted
from tactile_cube.measurement.recordings.recording import Recording

ANSWER = "best answer so far: "
REFITTED = re.compile(r" +(?:held-out error +)?(\d[\d.]*)  (.*@.*)")  # error over noise, and which effects leave it
CLEARLY = 0.98  # of the least error: sets with more laws come later, and always fit a little better
PHASES = {
    "steps of simulation a sample": 0.05, "base refitted": 0.15, "starts of": 0.3, "  held-out error": 0.7,
    "verdict": 0.9,
}  # fmt: skip
"""Words in a line of a diagnosis -> rough share of its time that has passed by then."""
LOOK = 2.0  # [s] between two looks at the clock while it says nothing


class Found(NamedTuple):
    """What a diagnosis answered."""

    text: str  # in plain words
    effects: list[str]  # what is missing, NAME@JOINT; of sets that do as well the first; a part where not all was found
    fitted: Fitted  # the model that it recommends
    over_noise: float  # error of its segments of untouched trials, in units of the sensor noise
    left_out: bool  # whether it masked intervals of trials: its errors are of fewer samples than others


class Diagnosing:
    """Running diagnosis in a process of its own.

    Attributes:
        said: all its lines; `share`: rough share that is done; `best`: its best answer so far, in words.
        found: its answer; None: it runs, was stopped or failed.
    """

    def __init__(
        self, recording: Recording, model: ModelFile | None, own_effects: Sequence[str], seed: int, folder: Path
    ) -> None:
        """Start it beside a model (None: what the recording states); its files go to a folder."""
        self.said: list[str] = []
        self.share, self.best, self._began = 0.0, "nothing yet", time.monotonic()
        self.found: Found | None = None
        self._least = float("inf")
        self.stopped = False
        context = multiprocessing.get_context("spawn")
        self._receiver, sender = context.Pipe(duplex=False)
        work = (recording, model, list(own_effects), seed, folder, sender)
        self._process = context.Process(target=_diagnose, args=work, daemon=True)
        self._process.start()
        sender.close()

    @property
    def progress(self) -> str:
        """The share that is done, what it took, and the time that is left."""
        taken = time.monotonic() - self._began
        left = f", about {taken * (1.0 - self.share) / self.share:.0f} s left" if self.share else ""
        return f"about {100 * self.share:.0f} % done in {taken:.0f} s{left}"

    def lines(self) -> Iterator[str]:
        """Yield the progress, line by line, until it ends; an empty line where nothing is said for a while.

        Raises:
            InputError: what `diagnose` raises, or the process died.
        """
        while True:
            try:
                said = self._receiver.recv() if self._receiver.poll(LOOK) else ""
            except (EOFError, OSError):
                break
            if isinstance(said, InputError):
                raise said
            if isinstance(said, Found):
                self.found = said
            else:
                self._add(said)
                yield said
        self._process.join()
        if self.found is None and not self.stopped:
            raise InputError(f"diagnose ended with status {self._process.exitcode}; the terminal says why")

    def _add(self, line: str) -> None:
        self.said += [line] if line else []
        self.share = max([self.share, *(share for words, share in PHASES.items() if words in line)])
        if line.startswith("base refitted: "):
            self.best = f"nothing yet; the refitted model leaves {line.rpartition('error ')[2]}"
        elif line.startswith(ANSWER):
            self.best = line.removeprefix(ANSWER).partition("; next: ")[0]
        elif (fitted := REFITTED.fullmatch(line)) and float(fitted[1]) < CLEARLY * self._least:
            self._least, self.best = float(fitted[1]), f"{fitted[2]} leaves {fitted[1]} x sensor noise"

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
    try:
        found = diagnose(recording, seed=seed, effects=effects, model=model, say=lambda line: sender.send(line))
        found.write(folder)
        assert found.free is not None  # a workbench has free motion
        fitted, known = found.free.fitted, found.free.known
        light = replace(fitted, fit=replace(fitted.fit, columns=np.zeros(0), residual=np.zeros(0)))
        new = [term.label for term in fitted.model.terms if term.label not in known]
        over_noise = found.data["error_over_noise"]["with_effects"]
        sender.send(Found(found.text, new, light, over_noise, bool(found.data["left_out"])))
    except InputError as error:
        sender.send(error)
