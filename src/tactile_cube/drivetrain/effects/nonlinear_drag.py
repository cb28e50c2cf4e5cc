"""Drag that grows with a power of the speed."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import DAMPING, JOINT_TORQUE, VELOCITY


class NonlinearDrag(Effect):
    """Drag that grows with a power of the speed.

    tau -= coefficient * speed^2 * |v / speed|^power * sgn v. With the power 2 this is coefficient * v^2; `speed` is
    where another power gives the same torque.

    In data: an error that grows faster than the speed.
    Confused with: `viscous_friction` in motion of one speed.
    Source: churning of grease and fluids (power 2); windage and shear-thickening grease (higher).
    """

    name = "nonlinear_drag"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("coefficient", "N m s^2/rad^2", 0.0, 0.0, 1.0, 0.02, "as large as viscous friction at the top speed"),
        Parameter("power", unit="1", neutral=2.0, low=1.2, high=4.0, typical=2.0, source="2 of fluids", scale=0.5),
        Parameter("speed", unit="rad/s", neutral=2.0, low=0.01, high=100.0, typical=2.0, source="the joint's largest"),
    )

    forms = ({"coefficient": 0.02},)
    details = ("power",)

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return the speed at which `coefficient` is defined: the joint's largest."""
        return {"speed": scales.speed}

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the joint torque [N m]."""
        slope = p[0] * abs(x[VELOCITY, j])
        if p[1] != 2.0:
            slope *= (abs(x[VELOCITY, j]) / p[2]) ** (p[1] - 2.0) if x[VELOCITY, j] != 0.0 else 0.0
        x[DAMPING, j] += p[1] * slope
        return x[JOINT_TORQUE, j] - slope * x[VELOCITY, j]
