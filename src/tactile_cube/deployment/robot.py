"""Interface of a hand, simulated or real, to the control loop, and the limits of its commands."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import inf
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """Measurement of the hand.

    Attributes:
        time: when, on the clock of `Robot.wait` [s].
        q_m: joint angles `(joints,)` [rad], in the hand's order.
        torque: joint torques `(joints,)` [N m]; None: not measured.
    """

    time: float
    q_m: Array
    torque: Array | None = None


class Robot(Protocol):
    """A hand under an impedance controller tau = K_P (q_d - q_m) - K_D dq that keeps the last q_d it was sent.

    Its own controller has to take q_m for q_d once no command has come for `stop.timeout`: a program can be killed.
    """

    def wait(self) -> float:
        """Wait for the next tick of the fast loop; return its time on a monotonic clock [s]."""

    def read(self) -> Reading | None:
        """Return the newest measurement, or None if none has come since the last call."""

    def send(self, q_d: Array) -> None:
        """Give the impedance controller its desired angles `(joints,)` [rad]."""

    def wait_for_object(self) -> bool:
        """Return whether somebody confirmed, here at the robot, that the object is between the open fingers.

        Called every tick while the loop waits for it; Enter on the terminal confirms too.
        """

    def release(self) -> None:
        """Let go of the object: called once, when the policy begins to decide."""

    def close(self) -> None:
        """End the connection."""


RATE = 6.28  # largest change of a desired angle [rad/s]. Source: data sheet of the hand, about 360 deg/s.


def require_positive(numbers: Mapping[str, float]) -> None:
    """Raise an `InputError` for a key of the configuration whose value is no finite number above 0."""
    for key, value in numbers.items():
        if not (isinstance(value, (int, float)) and 0 < value < inf):
            raise InputError(f"{key} is {value}; give a finite number above 0")


@dataclass(frozen=True)
class JointLimits:
    """Range `lower` to `upper` `(joints,)` [rad], rate [rad/s] and torque K_P (q_d - q_m) [N m] of desired angles q_d.

    With the gains of the impedance law `(joints,)`: kp [N m/rad], and kd [N m s/rad], which only brakes.

    Raises:
        InputError: a limit that bounds nothing.
    """

    lower: Array
    upper: Array
    rate: float
    torque: float
    kp: Array
    kd: Array

    def __post_init__(self) -> None:
        require_positive({"rate_limit": self.rate, "torque_limit": self.torque})
        if not (self.lower <= self.upper).all():
            raise InputError(f"joint range {self.lower} to {self.upper} [rad]; a lower limit is above an upper one")
        if not ((self.kp >= 0) & (self.kp < inf)).all():
            raise InputError(f"kp is {self.kp} N m/rad; give finite numbers of 0 or more")

    @property
    def reach(self) -> Array:
        """How far a command may be from the measured angle: torque / K_P `(joints,)` [rad], inf without stiffness."""
        return np.asarray(np.divide(self.torque, self.kp, out=np.full(self.kp.shape, inf), where=self.kp > 0))


@dataclass(frozen=True)
class StopRules:
    """Which measurements are accepted, when the loop stops and how: `stop` of conf/deploy.yaml [s, rad, rad/s, N m]."""

    silence: float = 0.02
    lateness: float = 0.02
    margin: float = 0.1
    speed: float = 15.0
    saturation: float = 1.0
    tolerance: float = 0.01
    patience: float = 5.0
    timeout: float = 0.1

    def __post_init__(self) -> None:
        require_positive({f"stop.{name}": value for name, value in asdict(self).items()})


class Watchdog:
    """Checks every tick against the stop rules."""

    def __init__(self, rules: StopRules, names: tuple[str, ...]) -> None:
        self._rules, self._names = rules, names
        self._saturated = np.zeros(len(names))

    def judge(self, dt: float, silent: float, saturated: NDArray[np.bool_]) -> str:
        """Return why the hand must stop, in words; "" if it need not.

        By the times since the tick before and the last accepted measurement [s], and the joints at full torque.
        """
        rules = self._rules
        if dt > rules.lateness:
            return f"tick {1e3 * dt:.0f} ms after the one before, allowed {1e3 * rules.lateness:.0f} ms"
        if silent > rules.silence:
            return f"no measurement for {1e3 * silent:.0f} ms, allowed {1e3 * rules.silence:.0f} ms"
        self._saturated = np.where(saturated, self._saturated + dt, 0.0)
        names = ", ".join(self._names[at] for at in np.flatnonzero(self._saturated > rules.saturation))
        return f"{names}: all its torque for {rules.saturation:g} s" if names else ""
