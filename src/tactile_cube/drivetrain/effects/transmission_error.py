"""A position error that repeats with the gear's turn."""

from math import cos, sin

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.harmonic import harmonic
from tactile_cube.drivetrain.signals import ANGLE, MOTOR_POSITION


class TransmissionError(Effect):
    """Position error that repeats with the turn of a gear.

    q_m += sine * sin(harmonic q) + cosine * cos(harmonic q).

    In data: a wave over the position, at any torque.
    Confused with: `cogging`, whose error depends on the stiffness of control.
    Source: Tuttle and Seering, A nonlinear model of a harmonic drive gear transmission, 1996.
    """

    name = "transmission_error"
    stage = Stage.POSITION_SENSOR
    parameters = (
        Parameter("sine", unit="rad", neutral=0.0, low=-0.02, high=0.02, typical=0.003, source="1 arcmin to 0.5 deg"),
        Parameter("cosine", unit="rad", neutral=0.0, low=-0.02, high=0.02, typical=0.0, source="1 arcmin to 0.5 deg"),
        harmonic(source="eccentric pulleys to teeth"),
    )

    forms = ({"sine": 0.003, "cosine": 0.0, "harmonic": 10.0},)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor position [rad]."""
        angle = p[2] * x[ANGLE, j]
        return x[MOTOR_POSITION, j] + p[0] * sin(angle) + p[1] * cos(angle)
