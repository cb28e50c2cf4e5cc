"""A gap in the transmission."""

from collections.abc import Mapping
from math import exp, tanh

import numpy as np

from tactile_cube.compiled import compiled
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import (
    DAMPING,
    GAP,
    LEAD,
    LOOP_GAIN,
    LOOSE_TORQUE,
    MOTOR_POSITION,
    POSITION,
    TORQUE,
)

NEWTON_STEPS = 12
SHOWN = 0.5
"""Part of the link's motion that its sensor must show, or the link is free within its gap."""


def torque_behind_play(torque: Array, drop: Array, softness: Array) -> Array:
    """Return u softness with u softness + drop tanh(u) = torque: what is left when a smooth play has been crossed.

    Newton's method from below the root, where the curve bends away: it never oversteps. Numbers or arrays.
    """
    ratio, most = drop / softness, np.abs(torque) / softness
    u = np.maximum(most - ratio, most / (1.0 + ratio))
    for _ in range(NEWTON_STEPS):
        bent = np.tanh(u)
        u += (most - u - ratio * bent) / (1.0 + ratio * (1.0 - bent * bent))
    return np.sign(torque) * u * softness


def smooth_lead(torque: Array, smooth: Array | float, softness: Array | float) -> Array:
    """Return how far the motor leads in a smooth play under a torque [rad]."""
    return np.asarray(0.5 * smooth * np.tanh(torque / softness))


_torque_behind_play = compiled(torque_behind_play)


class Backlash(Effect):
    """Play between motor and link, in its three usual descriptions.

    - `play`: hysteresis of the reading. The motor encoder keeps its value until the link has moved through the gap.
    - `gap`: dead band of the spring. Within it the motor carries no torque and stands where its controller asks for
      none; on either flank it leads or lags by half a gap. Oil in the gap brings the motor 63 % of the way to that
      place in the time `crossing`, and pulls the link meanwhile.
    - `smooth`: the motor leads or lags by half of this angle as the torque changes its sign, softly over torques of
      `softness`. Seals or grease carry the motor through its gap.

    In data: a flat spot of fixed width in the position after each reversal, at any speed.
    Confused with: `elasticity` and `stribeck_friction` in motion of one amplitude; a preload removes backlash.
    Source: Nordin and Gutman, Controlling mechanical systems with backlash, 2002.
    """

    name = "backlash"
    stage = Stage.POSITION_SENSOR
    contains = ("elasticity",)
    parameters = (
        Parameter("play", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.01, source="0.1-1 deg"),
        Parameter("gap", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.0, source="0.1-1 deg"),
        Parameter("smooth", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.0, source="0.1-1 deg"),
        Parameter("softness", unit="N m", neutral=0.01, low=1e-4, high=0.5, typical=0.01, source="torque of a seal"),
        Parameter("crossing", unit="s", neutral=0.0, low=0.0, high=0.2, typical=0.0, source="oil; ms", scale=0.005),
    )

    forms = ({"play": 0.01}, {"gap": 0.01}, {"smooth": 0.01, "softness": 0.01})
    details = ("crossing",)

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return `crossing` where there is a gap to cross."""
        return cls.details if values["gap"] > 0.0 else ()

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 4: offset within the play, first-call flag, last reading, offset within the gap."""
        return 4

    @staticmethod
    def free_lead(lead: Array, p: Array, gain: Array) -> Array:
        """Return how far the motor runs ahead within its gap (..., n) [rad].

        Args:
            lead: (..., n) signal LEAD [rad].
            p: (..., n, 5) parameters.
            gain: (..., n) signal LOOP_GAIN [N m/rad].
        """
        half, softness = 0.5 * p[..., 2], np.where(p[..., 3] > 0.0, p[..., 3], 1.0)
        edge = np.where(p[..., 4] > 0.0, 0.0, 0.5 * p[..., 1])
        first = np.clip(lead, -edge, edge)
        torque = torque_behind_play(gain * (lead - first), gain * half, softness)
        return np.asarray(first + smooth_lead(torque, p[..., 2], softness))

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor position [rad] without the drive's deflection and without the play."""
        half = 0.5 * p[1]
        reading = x[MOTOR_POSITION, j]
        if half > 0.0:
            x[LEAD, j] -= reading - x[POSITION, j]
            lead = x[LEAD, j] if p[4] <= 0.0 else x[LEAD, j] + exp(-dt / p[4]) * (s[3] - x[LEAD, j])
            s[3] = min(max(lead, -half), half)
            x[GAP, j] = 1.0
            if abs(lead) < half:
                x[GAP, j] = 2.0
                if p[4] <= 0.0:
                    x[DAMPING, j] = 0.0
            reading += s[3]
        if p[2] > 0.0:
            gain, half = x[LOOP_GAIN, j], 0.5 * p[2]
            loose = x[LOOSE_TORQUE, j] - gain * (reading - x[POSITION, j])
            side = tanh(_torque_behind_play(loose, gain * half, p[3]) / p[3])
            shown = 1.0 / (1.0 + gain * half * (1.0 - side * side) / p[3])
            x[LEAD, j] = loose / gain + s[3]
            x[DAMPING, j] *= shown
            x[GAP, j] = 1.0 if shown > SHOWN else 2.0
            reading += half * side
        return reading

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor position [rad]."""
        reading = x[MOTOR_POSITION, j]
        if p[0] > 0.0:
            half = 0.5 * p[0]
            if s[1] == 0.0:
                s[0] = 0.0
                s[2] = reading
                s[1] = 1.0
            s[0] = min(max(s[0] - (reading - s[2]), -half), half)
            s[2] = reading
            reading += s[0]
        if p[2] > 0.0:
            reading += 0.5 * p[2] * tanh(x[TORQUE, j] / p[3])
        return reading + s[3]
