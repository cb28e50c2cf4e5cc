"""Friction proportional to the joint's speed."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, VELOCITY


class ViscousFriction(Effect):
    """Viscous friction on the link side: tau -= damping * v.

    Unlike the controller's K_D it does not pass through the drive: the torque sensor does not see it.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "viscous_friction"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter(
            "damping",
            unit="N m s/rad",
            neutral=0.0,
            low=0.0,
            high=1.0,
            typical=0.05,
            source="0.004-0.3 N m s/rad in geared joints",
        ),
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Joint torque [N m]."""
        x[DAMPING, j] += p[0]
        return x[JOINT_TORQUE, j] - p[0] * x[VELOCITY, j]
