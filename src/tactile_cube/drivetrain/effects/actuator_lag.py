"""A torque that follows its command with a first-order lag."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, TORQUE


class ActuatorLag(Effect):
    """time_constant * s' = tau - s; s reaches the joint.

    Source: torque loops and tendons, 5-100 ms (Shadow hand: 54 ms).
    """

    name = "actuator_lag"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.3, typical=0.01, source="5-100 ms"),
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Delivered torque, first-call flag."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Motor torque [N m]."""
        if p[0] <= 0.0:
            return x[TORQUE, j]
        if s[1] == 0.0:
            s[0] = x[TORQUE, j]
            s[1] = 1.0
        share = 1.0 - exp(-dt / p[0])
        x[DAMPING, j] *= share
        s[0] += (x[TORQUE, j] - s[0]) * share
        return s[0]
