"""A torque that follows its command with a first-order lag."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import ACCELERATION, DAMPING, TORQUE


class ActuatorLag(Effect):
    """Motor torque that follows the torque asked for with a first-order lag.

    time_constant * s' = tau - s; the torque s reaches the joint.

    In data: a delay in slow motion; fast motion loses amplitude too.
    Confused with: `command_delay` below 1 / (2 pi time_constant); `reflected_inertia`.
    Source: torque loops and tendons, 5-100 ms (Shadow hand: 54 ms).
    """

    name = "actuator_lag"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.3, typical=0.01, source="5-100 ms"),
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 4: delivered torque, first-call flag, last torque asked for and its share in the delivered one."""
        return 4

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m], exact for an input that is linear from step to step.

        The torque asked for depends on the speed in the middle of a step. The last step's state is moved to its end
        before it is used.
        """
        asked = x[TORQUE, j]
        if p[0] <= 0.0:
            return asked
        if s[1] == 0.0:
            s[0] = asked
            s[1] = 1.0
            s[2] = asked
        later = 0.5 * dt * x[DAMPING, j] * x[ACCELERATION, j]
        s[0] -= s[3] * later
        s[2] -= later
        kept = exp(-dt / p[0])
        mean = (1.0 - kept) * p[0] / dt
        x[DAMPING, j] *= 1.0 - mean
        s[0] = kept * s[0] + (mean - kept) * s[2] + (1.0 - mean) * asked
        s[2] = asked
        s[3] = 1.0 - mean
        return s[0]
