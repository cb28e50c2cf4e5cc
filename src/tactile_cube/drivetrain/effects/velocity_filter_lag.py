"""Damping that acts on a filtered velocity."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, MEASURED_VELOCITY


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
        """Filtered velocity, first-call flag."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Measured velocity [rad/s]."""
        if p[0] <= 0.0:
            return x[MEASURED_VELOCITY, j]
        if s[1] == 0.0:
            s[0] = x[MEASURED_VELOCITY, j]
            s[1] = 1.0
        share = 1.0 - exp(-dt / p[0])
        x[DAMPING, j] *= share
        s[0] += (x[MEASURED_VELOCITY, j] - s[0]) * share
        return s[0]
