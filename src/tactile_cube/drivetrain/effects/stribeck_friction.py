"""Stiction: dry friction that is larger at standstill and falls with speed."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION, VELOCITY


class StribeckFriction(Effect):
    """Dry friction that is larger at standstill and falls with the speed (stiction).

    F += excess * exp(-|v / velocity|^exponent).

    In data: spikes after standstill; small motion falls short of its command.
    Confused with: `backlash` and `elasticity` in motion of one amplitude.
    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), who report exponents of 0.5 to 2.
    """

    name = "stribeck_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("excess", "N m", 0.0, 0.0, 0.5, 0.04, "+10-50 % of the Coulomb friction"),
        Parameter("velocity", "rad/s", 0.15, 0.01, 1.0, 0.15, "0.05-0.3 rad/s"),
        Parameter("exponent", "1", 2.0, 0.3, 4.0, 2.0, "0.5-2", scale=0.5),
    )

    forms = ({"excess": 0.04, "velocity": 0.15},)
    details = ("exponent",)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        speed = abs(x[VELOCITY, j] / p[1])
        return x[FRICTION, j] + p[0] * exp(-(speed * speed if p[2] == 2.0 else speed ** p[2]))
