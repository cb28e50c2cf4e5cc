"""`diagnose` in a process of its own, so that it can be watched and stopped at any time."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from threading import Thread
from typing import NamedTuple

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording


class Found(NamedTuple):
    """What a diagnosis answered.

    Attributes:
        text: in plain words.
        effects: what is missing, NAME@JOINT; of sets that do as well the first.
    """

    text: str
    effects: list[str]


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
        chosen = (found.data["sets"] or [found.effects])[0]
        sender.send(Found(found.text, list(dict.fromkeys(chosen))))
    except InputError as error:
        sender.send(error)
