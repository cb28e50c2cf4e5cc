"""Friction proportional to the joint's speed."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, VELOCITY


class ViscousFriction(Effect):
    """Friction proportional to the joint's speed.

    tau -= (damping + difference / 2 * sgn v) * v, on the link side. Unlike the controller's K_D it does not pass
    through the drive: the torque sensor does not see it.

    In data: an error proportional to the speed.
    Confused with: the controller's K_D; `coulomb_friction` and `nonlinear_drag` in motion of one speed.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "viscous_friction"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("damping", "N m s/rad", 0.0, 0.0, 1.0, 0.05, "0.004-0.3 N m s/rad in geared joints"),
        Parameter("difference", "N m s/rad", 0.0, -1.0, 1.0, 0.0, "5-30 % by direction: screws, worn gears, seals"),
    )
    forms = ({"damping": 0.05}, {"damping": 0.05, "difference": 0.02})

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the joint torque [N m]."""
        damping = p[0] + (0.5 * p[1] if x[VELOCITY, j] > 0.0 else -0.5 * p[1])
        x[DAMPING, j] += damping
        return x[JOINT_TORQUE, j] - damping * x[VELOCITY, j]
