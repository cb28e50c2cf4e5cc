"""A tendon or belt that gets stiffer as it is pulled."""

from math import asinh, sinh, sqrt

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.elasticity import STIFF
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DEFLECTION, TORQUE

CUBIC = (0.01, 0.1, 1.0)
"""Torques at which the cubic part of the spring equals the linear one where a search starts, in usual torques."""


class StiffeningElasticity(Effect):
    """Tendon or belt that gets stiffer as it is pulled.

    tau = K d + cubic * d^3 with 1 / K = 1 / K_e + compliance, d = q_m - q.

    In data: odd harmonics; soft at small torques, stiff at large ones.
    Confused with: `elasticity` in motion of one amplitude; two preloads separate them.
    Source: Palli et al., tendon transmissions; Spong 1987 with a cubic spring.
    """

    name = "stiffening_elasticity"
    stage = Stage.DEFLECTION
    contains = ("elasticity",)
    parameters = (
        Parameter("compliance", "rad/(N m)", 0.0, 0.0, 2.0, 0.1, "slack tendons: 2-20 N m/rad"),
        Parameter("cubic", "N m/rad^3", 0.0, 0.0, 10000000.0, 2000.0, "as large as the linear part at 10-50 mrad"),
    )

    forms = ({"compliance": 0.1, "cubic": 2e3},)

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return springs whose cubic part is as large as the linear one at the torques of `CUBIC`."""
        (form,) = cls.forms_at(scales)
        springs = (form["compliance"], STIFF * form["compliance"])
        return [
            {"compliance": soft, "cubic": 1.0 / (soft**3 * (part * scales.torque) ** 2)}
            for soft in springs
            for part in CUBIC
        ]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the deflection q_m - q [rad]: the real root of cubic * d^3 + K d = tau (Cardano)."""
        torque = x[TORQUE, j]
        deflection = x[DEFLECTION, j] + p[0] * torque
        if p[1] <= 0.0 or torque * deflection <= 0.0:
            return deflection
        linear = torque / deflection / p[1]
        half_width = sqrt(linear / 3.0)
        return 2.0 * half_width * sinh(asinh(1.5 * torque / p[1] / (linear * half_width)) / 3.0)
