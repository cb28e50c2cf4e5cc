"""A motor whose torque falls with its speed."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DAMPING, TORQUE, VELOCITY

UNLIMITED = 1e9
"""Neutral value of `stall`: a supply that is never too weak."""
FASTER = (1.2, 2.5)
"""No-load speeds at which a search starts, as multiples of the largest speed of the recording."""


class BackEmf(Effect):
    """Motor whose torque falls with its speed: back-EMF eats up the voltage of the supply.

    -stall * (1 + dq / no_load) <= tau <= stall * (1 - dq / no_load): what the supply can drive through the winding of a
    DC motor, whose current a loop controls below that. `stall` is the largest torque at rest, `no_load` the speed at
    which no torque is left. A drive that sets the voltage and not the current loses stall / no_load * dq at any torque:
    that is `viscous_friction`, with `torque_saturation` at the stall torque.

    In data: fast motion falls short of its command, and only where it takes much torque.
    Confused with: `torque_saturation`, `rate_limit`; `viscous_friction` in motion at the limit alone.
    Source: the torque-speed line of any DC motor's data sheet.
    """

    name = "back_emf"
    stage = Stage.MOTOR_TORQUE
    contains = ("torque_saturation",)
    parameters = (
        Parameter("stall", "N m", UNLIMITED, 0.005, UNLIMITED, 0.2, "data sheet", scale=0.02),
        Parameter("no_load", "rad/s", 10.0, 0.5, 1e3, 5.0, "data sheet"),
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return stall torques from the recording's usual torque to twice its largest, at two no-load speeds."""
        levels = np.geomspace(scales.torque, 2.0 * scales.seldom, 3)
        return [{"stall": float(level), "no_load": times * scales.speed} for level in levels for times in FASTER]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        if p[0] >= UNLIMITED:
            return x[TORQUE, j]
        slope = p[0] / p[1]
        lost = slope * x[VELOCITY, j]
        torque = min(max(x[TORQUE, j], -p[0] - lost), p[0] - lost)
        if torque != x[TORQUE, j]:
            x[DAMPING, j] = slope
        return torque
