"""A hand in real time, for the command `deploy`, whose joints get blocked and whose calls fail on demand."""

import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from tactile_cube.api import deployment
from tactile_cube.cli import command_line
from tactile_cube.deployment.controller import PolicyController
from tactile_cube.deployment.robot import Reading
from tactile_cube.hand import DLR_HAND2
from tactile_cube.simulation import constants_of

FILE = "BLOCKED_HAND"
"""Environment variable with the path of the file that both sides map."""
SILENT, CONFIRMED = 0.5, 1.0
"""Seconds without a measurement at first, and until the object is confirmed."""
FAILING, LATE = 0.3, 0.3
"""For how long sending fails, and by how much a tick is late [s]."""
KP = np.asarray(constants_of(DLR_HAND2).kp)
SHARED = np.dtype(
    [(name, "i8") for name in ("ready", "blocked", "way", "closed")]
    + [("command", "f8", (DLR_HAND2.joints,)), ("measured", "f8", (DLR_HAND2.joints,))]
)
"""What the attacker sets, and what is left of a process: the last command and the angles at that time [rad]."""
CLOCKS = ("clock frozen", "clock NaN", "clock back by 1 h", "ticks late")
RAISING = ("wait raises", "read raises", "send raises")
OWN = ("", *CLOCKS, *RAISING, "send fails for 0.3 s", "policy raises")
"""What the hand does itself; the rest is done to the process."""


def shared(path: Path, mode: Any = "r+") -> np.memmap[Any, Any]:
    """Map the file; it outlives the process."""
    return np.memmap(path, SHARED, mode, shape=(1,))


def torque(state: np.void) -> float:
    """Spring torque of the last command [N m]."""
    return float(np.max(KP * np.abs(state["command"] - state["measured"])))


class BlockedHand:
    """A `Robot`: joints that follow until they are blocked."""

    def __init__(self, **_: object) -> None:
        self._state: Any = shared(Path(os.environ[FILE]))[0]
        self._q = np.asarray(DLR_HAND2.start_angles) - 0.05
        self._began = self._tick = time.monotonic()
        self._awaited, self._struck, self._raised = math.inf, math.inf, False
        self._state["command"] = self._state["measured"] = self._q
        self._state["ready"] = 1

    def wait(self) -> float:
        """Sleep until the next tick; return what the clock says."""
        way = OWN[self._state["way"]]
        self._tick = max(self._tick + 1e-3, time.monotonic() - 1e-3)
        time.sleep(max(0.0, self._tick - time.monotonic()) + LATE * (way == "ticks late"))
        now = time.monotonic()
        self._struck = min(self._struck, now) if way else math.inf
        self._fail("wait raises")
        clocks = {"clock frozen": self._struck, "clock NaN": math.nan, "clock back by 1 h": now - 3600.0}
        return clocks.get(way, now)

    def read(self) -> Reading | None:
        """Return the angles."""
        self._fail("read raises")
        now = time.monotonic()
        return Reading(now, self._q.copy()) if now - self._began > SILENT else None

    def send(self, q_d: np.ndarray) -> None:
        """Follow, unless blocked."""
        self._fail("send raises")
        if OWN[self._state["way"]] == "send fails for 0.3 s" and time.monotonic() - self._struck < FAILING:
            raise OSError("gone")
        self._state["measured"], self._state["command"] = self._q, q_d
        if not self._state["blocked"]:
            self._q = np.array(q_d)

    def wait_for_object(self) -> bool:
        """Confirm after a while."""
        self._awaited = min(self._awaited, time.monotonic())
        return time.monotonic() - self._awaited > CONFIRMED

    def release(self) -> None:
        """Nobody holds an object."""

    def close(self) -> None:
        """Note that the hand was closed."""
        self._state["closed"] = 1

    def _fail(self, way: str) -> None:
        if OWN[self._state["way"]] == way and not self._raised:
            self._raised = True
            raise OSError("gone")


class _Raising(PolicyController):
    def step(self, *given: Any) -> Any:
        if OWN[int(shared(Path(os.environ[FILE]))[0]["way"])] == "policy raises":
            raise ZeroDivisionError("in the policy")
        return super().step(*given)


if __name__ == "__main__":
    vars(deployment)["PolicyController"] = _Raising
    command_line("deploy")()
