"""A controller that adds a torque in proportion to the speed of its command."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import COMMAND, TORQUE


class VelocityFeedforward(Effect):
    """Controller that adds a torque in proportion to the speed of its command.

    tau += gain * (q_d - f) / smoothing with smoothing * f' = q_d - f: the command's speed through a low-pass, for
    commands jump. A controller that damps the error of the speed, K_D (dq_d - dq), has a gain of K_D.

    In data: the joint lags less behind a moving command than its gains say; no change at rest.
    Confused with: a command that is logged late; the opposite of `command_delay`.
    Source: Craig, Introduction to Robotics, ch. 10; the velocity feed-forward of any servo drive.
    """

    name = "velocity_feedforward"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("gain", "N m s/rad", 0.0, 0.0, 2.0, 0.1, "up to K_D"),
        Parameter("smoothing", "s", 0.005, 1e-4, 0.1, 0.005, "1-20 ms"),
    )
    forms = ({"gain": 0.1},)
    details = ("smoothing",)

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 2: first-call flag and smoothed command."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]: its mean over a step of a command that is held."""
        if s[0] == 0.0:
            s[0], s[1] = 1.0, x[COMMAND, j]
        followed = (1.0 - exp(-dt / p[1])) * (x[COMMAND, j] - s[1])
        s[1] += followed
        return x[TORQUE, j] + p[0] * followed / dt
