"""A torque limit below the stated one."""

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DAMPING, TORQUE

LEVELS = 9
"""Between the torque exceeded in half of the samples and the largest ones, by equal factors."""


class TorqueSaturation(Effect):
    """|tau| <= limit.

    Source: current limits of drives.
    """

    name = "torque_saturation"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter(
            "limit",
            unit="N m",
            neutral=1e9,
            low=0.005,
            high=1e9,
            typical=0.1,
            source="a fraction of the stated limit",
            scale=0.02,
        ),
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Limits among the torques that the recording asks for."""
        return [{"limit": float(level)} for level in np.geomspace(scales.often, scales.seldom, LEVELS)]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Motor torque [N m]."""
        if abs(x[TORQUE, j]) > p[0]:
            x[DAMPING, j] = 0.0
        return min(max(x[TORQUE, j], -p[0]), p[0])
