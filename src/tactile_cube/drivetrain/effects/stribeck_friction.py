"""Stiction: dry friction that is larger at standstill and falls with speed."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION, VELOCITY


class StribeckFriction(Effect):
    """(Fs - Fc) exp(-(v / vs)^2): spikes after standstill, and a gain that drops at small amplitudes.

    Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994).
    """

    name = "stribeck_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("excess", "N m", 0.0, 0.0, 0.5, 0.04, "+10-50 % of the Coulomb friction"),
        Parameter("velocity", "rad/s", 0.15, 0.01, 1.0, 0.15, "0.05-0.3 rad/s"),
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:  # noqa: D102
        speed = x[VELOCITY, j] / p[1]
        return x[FRICTION, j] + p[0] * exp(-speed * speed)
