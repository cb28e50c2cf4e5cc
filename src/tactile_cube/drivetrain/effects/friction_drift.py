"""Dry friction that changes while the joint warms up."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION, TIME


class FrictionDrift(Effect):
    """Dry friction that changes while the joint warms up.

    F += friction + change * (1 - exp(-t / time_constant)), t from the start of the trial. The longest time constant
    stands for a change proportional to time. Trials of seconds cannot separate the two numbers then: only change /
    time_constant counts, and `change` may be far larger than any change in the recording.

    In data: a trend over time in the same repeated motion.
    Confused with: `coulomb_friction` in a single short trial.
    Source: Bittencourt and Axelsson, Modeling and experiment design for temperature effects of joint friction, 2014.
    """

    name = "friction_drift"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("change", unit="N m", neutral=0.0, low=-5.0, high=5.0, typical=0.02, source="-20 to -50 % over 20 K"),
        Parameter("time_constant", "s", 200.0, 0.5, 200.0, 5.0, "seconds (lubricant) to minutes (housing)"),
        Parameter("friction", unit="N m", neutral=0.0, low=-0.1, high=0.5, typical=0.0, source="cold, beyond nominal"),
    )

    forms = ({"change": 0.02, "time_constant": 5.0}, {"change": -0.02, "time_constant": 5.0, "friction": 0.04})
    details = ("friction",)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        if p[0] == 0.0 and p[2] == 0.0:
            return x[FRICTION, j]
        return max(x[FRICTION, j] + p[2] + p[0] * (1.0 - exp(-x[TIME, 0] / p[1])), 0.0)
