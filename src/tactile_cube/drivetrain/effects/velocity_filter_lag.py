"""Damping that acts on a filtered velocity."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import ACCELERATION, DAMPING, MEASURED_VELOCITY


class VelocityFilterLag(Effect):
    """The controller's velocity passes a first-order low-pass: time_constant * v_f' = v - v_f.

    Source: any controller that differentiates an encoder.
    """

    name = "velocity_filter_lag"
    stage = Stage.VELOCITY_SENSOR
    parameters = (
        Parameter("time_constant", unit="s", neutral=0.0, low=0.0, high=0.2, typical=0.005, source="1-30 ms"),
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Filtered velocity, first-call flag, velocity of the last step, its own share in what was filtered."""
        return 4

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Measured velocity [rad/s], exact for an input that is a straight line from step to step.

        The speed of a step is that of its middle; what was remembered of the last step is carried on to its end.
        """
        asked = x[MEASURED_VELOCITY, j]
        if p[0] <= 0.0:
            return asked
        if s[1] == 0.0:
            s[0] = asked
            s[1] = 1.0
            s[2] = asked
        later = 0.5 * dt * x[ACCELERATION, j]
        s[0] += s[3] * later
        s[2] += later
        kept = exp(-dt / p[0])
        mean = (1.0 - kept) * p[0] / dt
        x[DAMPING, j] *= 1.0 - mean
        s[0] = kept * s[0] + (mean - kept) * s[2] + (1.0 - mean) * asked
        s[2] = asked
        s[3] = 1.0 - mean
        return s[0]
