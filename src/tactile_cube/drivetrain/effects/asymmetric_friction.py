"""Dry friction that differs between the two directions."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DIRECTION, FRICTION


class AsymmetricFriction(Effect):
    """Dry friction that differs between the two directions of motion.

    F(+v) - F(-v) = difference; the mean of both is `friction` above the nominal friction. A `ratio` r multiplies all
    dry friction, also that of other effects, by 1 + r in the positive and 1 - r in the negative direction.

    In data: steps at reversals that are not symmetric about zero torque.
    Confused with: `torque_bias` while the joint moves; `payload` in one posture.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "asymmetric_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("difference", "N m", 0.0, -0.3, 0.3, 0.02, "5-30 % of the dry friction; more with worn gears"),
        Parameter("ratio", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.0, source="5-30 %"),
        Parameter("friction", unit="N m", neutral=0.0, low=-0.1, high=0.5, typical=0.0, source="worn or dry gears"),
    )
    forms = ({"difference": 0.02}, {"difference": 0.02, "friction": 0.02}, {"ratio": 0.2, "friction": 0.02})

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        return (x[FRICTION, j] + p[2] + 0.5 * p[0] * x[DIRECTION, j]) * (1.0 + p[1] * x[DIRECTION, j])
