"""What a run has learned, shown while it learns: its side of a process that evaluates and draws.

The process reads the policy that the run has saved last. It has random generators, simulator and memory of its own, so
that the run learns bit for bit what it would without; it yields the processor to the run.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from tactile_cube.env import Conditions
from tactile_cube.errors import InputError
from tactile_cube.training.run import POLICY
from tactile_cube.visualization.viewer import has_display

VIEWERS = ("auto", "window", "web", "file")
PATIENCE = 300.0
"""How long the end of a run waits for an episode that was asked for [s]: with the start some ten s of a processor,
which a busy machine spreads over minutes."""
SILENCE = 5.0
"""After so long it says what it waits for [s]."""


class LiveView:
    """Asks for an evaluation episode every so many training episodes. A logger as those of `training.loggers`.

    Args:
        folder: of the run.
        resumed_at: environment steps at which this session begins; not used.
        every: training episodes from one to the next.
        viewer: "window", "web", "file", a Rerun URL to connect to, or "auto".

    Raises:
        InputError: a value that cannot be used.
    """

    def __init__(self, folder: Path, resumed_at: int, every: int = 300, viewer: str = "auto"):
        if not isinstance(every, int) or every < 1:
            raise InputError(f"visualization.live.every={every}: give at least 1 training episode")
        if viewer not in VIEWERS and "://" not in viewer:
            known = ", ".join(VIEWERS)
            raise InputError(f"visualization.live.viewer={viewer}: choose {known}, or give a URL such as "
                             "rerun+http://127.0.0.1:9876/proxy")  # fmt: skip
        if viewer == "auto":
            viewer = "window" if has_display() else "web"
        self._policy, self._every, self._shown = folder / POLICY, every, -every
        self.process = _start(folder, viewer)

    def log(self, steps: int, metrics: Mapping[str, float]) -> None:
        """Ask for an episode under the conditions in force if it is time; never waits."""
        episodes = int(metrics["episodes"])
        if self.process is None or episodes < self._shown + self._every or not self._policy.is_file():
            return
        self._shown = episodes
        request = request_line(steps, Conditions.from_columns(metrics))
        try:
            self.process.stdin.write(request.encode())  # type: ignore[union-attr]
        except BlockingIOError:
            pass  # it still draws earlier ones
        except OSError:
            print("live view: its process has ended; the run goes on without", file=sys.stderr, flush=True)
            self.process = None

    def close(self) -> None:
        """Let it draw what it was asked for, then end it; a viewer stays open."""
        if self.process is None:
            return
        self.process.stdin.close()  # type: ignore[union-attr]
        if self._shown < 0:  # nothing was asked for
            self.process.terminate()
        try:
            if not self._ended(SILENCE):
                words = f"draws what it was asked for last, for {PATIENCE:g} s at most; Ctrl-C leaves it out"
                print(f"live view: {words}", file=sys.stderr, flush=True)
                if not self._ended(PATIENCE):
                    print("live view: that was not drawn in time", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            print("live view: left out", file=sys.stderr, flush=True)
        self.process.terminate()  # without effect on one that has ended
        if not self._ended(SILENCE):
            self.process.kill()
            self.process.wait()
        self.process = None

    def _ended(self, patience: float) -> bool:
        """Whether the process ends within so many seconds."""
        try:
            self.process.wait(patience)  # type: ignore[union-attr]
        except subprocess.TimeoutExpired:
            return False
        return True


def request_line(steps: int, conditions: Conditions) -> str:
    """A request for an episode, at so many environment steps, as a line for the process that draws."""
    return json.dumps({"steps": steps, "conditions": asdict(conditions)}) + "\n"


def read_request(line: str) -> tuple[int, Conditions]:
    """Environment steps and conditions of a line of `request_line`."""
    request = json.loads(line)
    return request["steps"], Conditions(**request["conditions"])


def _start(folder: Path, viewer: str) -> subprocess.Popen[bytes] | None:
    """Start the process that draws; Ctrl-C at the terminal is the run's alone.

    It stays in the run's session: Linux shares the processor among sessions first, and priorities count within one.
    """
    words = [sys.executable, "-m", "tactile_cube.visualization.live_episodes", str(folder), viewer]
    one = {"OMP_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}
    process = subprocess.Popen(words, stdin=subprocess.PIPE, env=os.environ | one, bufsize=0, process_group=0)
    os.set_blocking(process.stdin.fileno(), False)  # type: ignore[union-attr]
    return process
