"""A torque limit below the stated one."""

from math import isfinite

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales, unit_at
from tactile_cube.drivetrain.signals import DAMPING, TORQUE

LEVELS = 9
"""Number of limits at which a search starts, from the median torque to the largest ones in equal factors."""

REACHED = 0.9
"""Share of the stated limit from which it counts as reached: limits of drives vary by a tenth."""

HARD = 0.02
"""A softness up to this counts as none: the torque is within 1.4 % of the limit, and larger powers overflow."""


class TorqueSaturation(Effect):
    """Torque limit below the stated one.

    |tau| <= limit. With a softness s > 0, tau = u / (1 + |u / limit|^(1 / s))^s approaches the limit; u is the torque
    asked for.

    In data: an error only where much torque is asked for.
    Confused with: `rate_limit`; `torque_curve`.
    Source: current limits of drives; saturating iron approaches its torque softly (0.4 is close to a tanh).
    """

    name = "torque_saturation"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("limit", "N m", 1e9, 0.005, 1e9, 0.1, "a fraction of the stated limit", scale=0.02),
        Parameter(
            "softness", unit="1", neutral=0.0, low=0.0, high=1.0, typical=0.0, source="0 hard, 0.4 tanh", scale=0.2
        ),
    )
    details = ("softness",)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return limits among the torques that the recording asks for."""
        return [{"limit": float(level)} for level in np.geomspace(scales.often, scales.seldom, LEVELS)]

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """Return the largest torque asked for, if it is below the stated limit: a limit above it does nothing."""
        if not isfinite(scales.torque_limit) or scales.seldom > REACHED * scales.torque_limit:
            return None
        return f"asked for up to {scales.seldom:.3g} of {scales.torque_limit:.3g} {unit_at('N m', scales.slides)}"

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        if p[1] > HARD:
            asked = 1.0 + abs(x[TORQUE, j] / p[0]) ** (1.0 / p[1])
            x[DAMPING, j] *= asked ** -(p[1] + 1.0)
            return x[TORQUE, j] * asked ** -p[1]
        if abs(x[TORQUE, j]) > p[0]:
            x[DAMPING, j] = 0.0
        return min(max(x[TORQUE, j], -p[0]), p[0])
