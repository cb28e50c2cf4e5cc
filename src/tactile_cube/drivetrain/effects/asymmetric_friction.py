"""Dry friction that differs between the two directions."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DIRECTION, FRICTION


class AsymmetricFriction(Effect):
    """F(+v) - F(-v) = difference; the mean of both is `friction` more than the nominal friction.

    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "asymmetric_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter(
            "difference",
            unit="N m",
            neutral=0.0,
            low=-0.3,
            high=0.3,
            typical=0.02,
            source="5-30 % of the dry friction; more with worn gears",
        ),
        Parameter("friction", unit="N m", neutral=0.0, low=-0.1, high=0.5, typical=0.0, source="worn or dry gears"),
    )
    forms = (
        {"difference": 0.02},
        {"difference": 0.02, "friction": 0.02},
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Friction limit [N m]."""
        return x[FRICTION, j] + p[1] + 0.5 * p[0] * x[DIRECTION, j]
