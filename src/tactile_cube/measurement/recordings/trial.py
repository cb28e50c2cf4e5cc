"""One trial on a uniform time grid: what was commanded and what was measured."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.columns import TrialColumns
from tactile_cube.measurement.recordings.description import Grasp, KnownForce, Touch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gains:
    """Controller of one trial: kp [N m/rad], kd [N m s/rad], torque_limit [N m], each of shape (joints,)."""

    kp: Array
    kd: Array
    torque_limit: Array


@dataclass(frozen=True, kw_only=True)
class Trial(TrialColumns):
    """One trial at uniform time steps from 0; `command[k]` acts from `time[k]` to `time[k + 1]`."""

    name: str  # file name without its ending
    file: str  # path inside the recording's folder
    kind: str  # kind of excitation; trials of one kind repeat one command
    initialisation: int  # robot initialisation it belongs to; each has joint offsets of its own
    # (n,) False where a sample counts in no error: it was interpolated, or follows commands before the log
    valid: NDArray[np.bool_]
    gains: Gains  # the controller in this trial
    force: KnownForce | None = None  # a known force on a link
    clamped: bool = False  # the links were held still
    touch: Touch | None = None  # the link ended at a known place
    warnings: tuple[str, ...] = field(default=(), repr=False)
    load: Grasp | None = None  # the object that the hand held, with all that is stated of it
    # when it began, from the start of its initialisation [s]; 0 where the stamps of its file do not tell
    begun: float = 0.0

    @property
    def linked(self) -> NDArray[np.int64]:
        """Joints with a sensor on their link."""
        none = np.zeros(0, dtype=np.int64)
        return none if self.link_position is None else np.flatnonzero(np.isfinite(self.link_position[0]))

    @property
    def is_bench(self) -> bool:
        """Whether it is a bench test, and not free motion."""
        return self.clamped or any(one is not None for one in (self.force, self.touch, self.load))

    @property
    def step(self) -> float:
        """Time between samples [s]."""
        return float(self.time[1] - self.time[0])

    @property
    def duration(self) -> float:
        """Length of the trial [s]."""
        return float(self.time[-1])

    def velocity(self, window: float = 0.03) -> Array:
        """Return the measured velocity (n, joints) [rad/s]: slope of a straight line through a sliding window [s].

        The window keeps quantisation out; a recording's sensor gives no velocity of its own.
        """
        half = max(1, min(round(0.5 * window / self.step), (len(self.time) - 1) // 2))
        lever = np.arange(-half, half + 1) / self.step / np.sum(np.arange(-half, half + 1) ** 2)
        padded = np.pad(self.position, ((half, half), (0, 0)), mode="reflect", reflect_type="odd")
        return np.stack([np.convolve(column, lever[::-1], mode="valid") for column in padded.T], axis=1)

    def with_earlier_commands(self, rows: int) -> Self:
        """Return the trial with its commands `rows` rows earlier; its last `rows` rows become invalid."""
        later = np.minimum(np.arange(len(self.valid)) + rows, len(self.valid) - 1)
        feedforward = None if self.feedforward is None else self.feedforward[later]
        known = np.arange(len(self.valid)) < len(self.valid) - rows
        return replace(self, command=self.command[later], feedforward=feedforward, valid=self.valid & known)
