"""A motor whose torque is not proportional to its command."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DAMPING, TORQUE

SMALLEST = 0.01
"""Part of `reference` below which the curve is a straight line to zero."""


class TorqueCurve(Effect):
    """Motor whose torque is not proportional to its command.

    tau = (1 + gain) * reference * |u / reference|^(1 + bend) * sgn u, u the torque asked for. A negative bend gives
    less than proportional torque beyond `reference` and more below it. Servos whose controller sets the duty cycle do
    this, and motors whose iron saturates.

    In data: too much torque for small commands and too little for large ones, or the reverse.
    Confused with: `torque_gain` in motion of one amplitude; `torque_saturation`.
    Source: Duclos et al., BAM: extended friction models for servo actuators, 2025 (duty law); Mohan, Power Electronics,
    2003 (saturation).
    """

    name = "torque_curve"
    stage = Stage.MOTOR_TORQUE
    contains = ("torque_gain",)
    parameters = (
        Parameter("bend", unit="1", neutral=0.0, low=-0.8, high=1.5, typical=-0.2, source="duty laws: -0.1 to -0.5"),
        Parameter("gain", unit="1", neutral=0.0, low=-0.8, high=1.0, typical=0.0, source="1-15 %"),
        Parameter("reference", unit="N m", neutral=0.15, low=1e-3, high=10.0, typical=0.15, source="usual torque"),
    )

    forms = ({"bend": -0.2, "gain": 0.0},)

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return the usual torque, at which `bend` changes nothing."""
        return {"reference": scales.torque}

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        if p[0] == 0.0 and p[1] == 0.0:
            return x[TORQUE, j]
        load = abs(x[TORQUE, j]) / p[2]
        factor = (1.0 + p[1]) * max(load, SMALLEST) ** p[0]
        x[DAMPING, j] *= factor * (1.0 + p[0] if load > SMALLEST else 1.0)
        return x[TORQUE, j] * factor
