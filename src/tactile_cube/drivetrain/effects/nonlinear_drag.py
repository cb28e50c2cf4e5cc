"""Drag that grows with the square of the speed."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, VELOCITY


class NonlinearDrag(Effect):
    """tau -= coefficient * v |v|.

    Source: churning of grease and fluids.
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
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Joint torque [N m]."""
        x[DAMPING, j] += 2.0 * p[0] * abs(x[VELOCITY, j])
        return x[JOINT_TORQUE, j] - p[0] * x[VELOCITY, j] * abs(x[VELOCITY, j])
