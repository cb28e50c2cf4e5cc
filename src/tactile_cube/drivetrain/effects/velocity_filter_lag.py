"""Damping that acts on a filtered velocity."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import ACCELERATION, DAMPING, MEASURED_VELOCITY


class VelocityFilterLag(Effect):
    """Damping that acts on a filtered velocity.

    time_constant * v_f' = v - v_f: the controller's velocity passes a first-order low-pass, and a second one where
    `second` is above zero.

    In data: less damping than stated in fast motion; overshoot.
    Confused with: `command_delay` and `actuator_lag` in slow motion.
    Source: any controller that differentiates an encoder; the filters of servo drives are of first or second order.
    """

    name = "velocity_filter_lag"
    stage = Stage.VELOCITY_SENSOR
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.5, typical=0.005, source="1-30 ms"),
        Parameter("second", unit="s", neutral=0.0, low=0.0, high=0.5, typical=0.0, source="as the first, or none"),
    )

    forms = ({"time_constant": 0.005},)
    details = ("second",)

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 6: first-call flag, last speed; for each filter its output and the share of its last input in that."""
        return 6

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the measured velocity [rad/s], exact for an input that is linear from step to step.

        The speed of a step is that of its middle. The last step's state is moved to its end before it is used.
        """
        asked = x[MEASURED_VELOCITY, j]
        if p[0] <= 0.0:
            return asked
        if s[0] == 0.0:
            s[0] = 1.0
            s[1] = asked
            s[2] = asked
            s[4] = asked
        later = 0.5 * dt * x[ACCELERATION, j]
        before = s[1] + later
        s[1] = asked
        for k in range(2, 6, 2):
            time_constant = p[k // 2 - 1]
            if time_constant > 0.0:
                later *= s[k + 1]
                last = s[k] + later
                kept = exp(-dt / time_constant)
                mean = (1.0 - kept) * time_constant / dt
                x[DAMPING, j] *= 1.0 - mean
                s[k] = kept * last + (mean - kept) * before + (1.0 - mean) * asked
                s[k + 1] = 1.0 - mean
                before, asked = last, s[k]
        return asked
