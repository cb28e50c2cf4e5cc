"""Drag that grows with a power of the speed."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, VELOCITY


class NonlinearDrag(Effect):
    """tau -= coefficient * speed^2 * |v / speed|^power * sgn v: with the square of the speed, or with another power.

    Source: churning of grease and fluids (square); windage and shear-thickening grease (higher).
    """

    name = "nonlinear_drag"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter(
            "coefficient",
            unit="N m s^2/rad^2",
            neutral=0.0,
            low=0.0,
            high=1.0,
            typical=0.02,
            source="as large as viscous friction at the top speed",
        ),
        Parameter("power", unit="1", neutral=2.0, low=1.2, high=4.0, typical=2.0, source="2 of fluids", scale=0.5),
        Parameter("speed", unit="rad/s", neutral=2.0, low=0.01, high=100.0, typical=2.0, source="a usual one"),
    )

    forms = ({"coefficient": 0.02},)
    details = ("power",)

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """The coefficient is that of a square law at the joint's largest speeds."""
        return {"speed": scales.speed}

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Joint torque [N m]."""
        slope = p[0] * abs(x[VELOCITY, j])
        if p[1] != 2.0:
            slope *= (abs(x[VELOCITY, j]) / p[2]) ** (p[1] - 2.0) if x[VELOCITY, j] != 0.0 else 0.0
        x[DAMPING, j] += p[1] * slope
        return x[JOINT_TORQUE, j] - slope * x[VELOCITY, j]
