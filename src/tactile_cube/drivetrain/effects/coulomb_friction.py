"""Dry friction of constant size."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION


class CoulombFriction(Effect):
    """Fc sgn(v): a step in torque at every reversal, whatever the speed; the joint sticks below it."""

    name = "coulomb_friction"
    stage = Stage.FRICTION
    parameters = (
        Parameter("friction", "N m", 0.0, 0.0, 0.5, 0.03, "identification.md: 0.01-0.1 N m, 2-10 % of rating"),
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:  # noqa: D102
        return x[FRICTION, j] + p[0]
