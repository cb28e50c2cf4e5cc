"""A torque ripple that repeats with the position."""

from math import cos, sin

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import ANGLE, TORQUE


class Cogging(Effect):
    """tau += sine * sin(harmonic q) + cosine * cos(harmonic q).

    Source: Holtz and Springob, Identification and compensation of torque ripple, 1996.
    """

    name = "cogging"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("sine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.01, source="1-5 % of the rating"),
        Parameter("cosine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source="1-5 % of the rating"),
        Parameter(
            "harmonic", unit="1/rad", neutral=10.0, low=1.0, high=250.0, typical=10.0, source="poles times gear ratio"
        ),
    )

    forms = ({"sine": 0.01, "cosine": 0.0, "harmonic": 10.0},)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Motor torque [N m]."""
        angle = p[2] * x[ANGLE, j]
        return x[TORQUE, j] + p[0] * sin(angle) + p[1] * cos(angle)
