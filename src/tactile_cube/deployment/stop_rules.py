"""When the loop stops the hand by itself."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.robot import Reading
from tactile_cube.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StopRules:
    """Bounds beyond which the loop stops and holds the fingers where they are.

    Attributes:
        silence: longest time without a measurement [s]: two policy steps have ten times that.
        lateness: longest time between two ticks [s].
        margin: how far a measured angle may lie outside the hand's range [rad]: joint offsets are up to 0.06 rad.
        speed: largest joint speed [rad/s]. Source: data sheet of the hand, about 360 deg/s.
        saturation: longest time that a joint may ask for all the torque it has [s].
    """

    silence: float = 0.02
    lateness: float = 0.02
    margin: float = 0.1
    speed: float = 6.28
    saturation: float = 1.0

    def __post_init__(self) -> None:
        """Refuse bounds that no hand can keep."""
        for name, value in asdict(self).items():
            if not value > 0:
                raise InputError(f"stop.{name} is {value}; give a number above 0")


class Watchdog:
    """Judges every tick by the stop rules.

    Args:
        rules: the bounds.
        lower: of the hand's range `(12,)` [rad].
        upper: likewise.
        names: of the joints.
    """

    def __init__(self, rules: StopRules, lower: Array, upper: Array, names: tuple[str, ...]) -> None:
        self._rules, self._lower, self._upper, self._names = rules, lower, upper, names
        self._saturated = np.zeros(len(names))

    def judge(self, now: float, dt: float, last: Reading, saturated: NDArray[np.bool_]) -> str:
        """Return why the hand must stop, in words; "" if it need not.

        Args:
            now: time of this tick [s].
            dt: since the tick before [s].
            last: the newest measurement.
            saturated: joints that ask for all their torque `(12,)`.
        """
        rules = self._rules
        if dt > rules.lateness:
            return f"tick {1e3 * dt:.0f} ms after the one before, allowed {1e3 * rules.lateness:.0f} ms"
        if now - last.time > rules.silence:
            return f"no measurement for {1e3 * (now - last.time):.0f} ms, allowed {1e3 * rules.silence:.0f} ms"
        if not np.isfinite(last.q_m + last.dq).all():
            return f"{self._which(~np.isfinite(last.q_m + last.dq))}: not a number"
        beyond = np.maximum(self._lower - last.q_m, last.q_m - self._upper)
        if (beyond > rules.margin).any():
            return f"{self._which(beyond > rules.margin)}: {beyond.max():.2f} rad outside its range"
        fast = np.abs(last.dq) > rules.speed
        if fast.any():
            return f"{self._which(fast)}: {np.abs(last.dq).max():.1f} rad/s, allowed {rules.speed:g} rad/s"
        self._saturated = np.where(saturated, self._saturated + dt, 0.0)
        long = self._saturated > rules.saturation
        return f"{self._which(long)}: all its torque for {rules.saturation:g} s" if long.any() else ""

    def _which(self, flags: NDArray[np.bool_]) -> str:
        return ", ".join(name for name, flag in zip(self._names, flags, strict=True) if flag)
