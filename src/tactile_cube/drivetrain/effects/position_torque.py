"""A torque that depends on the position alone."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import ANGLE, JOINT_TORQUE

KNOTS = 17
SOURCE = "return springs, cables, detents"


class PositionTorque(Effect):
    """Torque that depends on the position alone: spring, cable or detent.

    tau += bias - stiffness * q + f(q). f is a cubic B-spline with 17 equally spaced control torques from `first` to
    `last`, and constant beyond.

    In data: an error that is the same function of the position in both directions.
    Confused with: `cogging`, `joint_stop`, `torque_bias`, `payload`: special shapes of the same function.
    Source: cable and tendon routing; any spring parallel to the joint.
    """

    name = "position_torque"
    stage = Stage.JOINT_TORQUE
    contains = ("torque_bias",)
    parameters = (
        Parameter("stiffness", unit="N m/rad", neutral=0.0, low=-3.0, high=3.0, typical=0.05, source=SOURCE),
        Parameter("bias", unit="N m", neutral=0.0, low=-1.0, high=1.0, typical=0.0, source=SOURCE),
        Parameter("first", unit="rad", neutral=-1.0, low=-7.0, high=7.0, typical=-1.0, source="range of motion"),
        Parameter("last", unit="rad", neutral=1.0, low=-7.0, high=7.0, typical=1.0, source="range of motion"),
        *(
            Parameter(f"torque_{k}", unit="N m", neutral=0.0, low=-1.0, high=1.0, typical=0.0, source=SOURCE)
            for k in range(KNOTS)
        ),
    )

    forms = ({"stiffness": 0.05, "bias": 0.0}, {f"torque_{k}": 0.01 for k in range(KNOTS)})

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return the ends of the profile: those of the motion."""
        return {"first": scales.low, "last": scales.high}

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the joint torque [N m]."""
        place = min(max((x[ANGLE, j] - p[2]) / (p[3] - p[2]) * (KNOTS - 1), 0.0), KNOTS - 1.000001)
        knot = int(place)
        u = place - knot
        shape = p[4 + max(knot - 1, 0)] * (1.0 - u) ** 3
        shape += p[4 + knot] * (4.0 - 6.0 * u**2 + 3.0 * u**3)
        shape += p[5 + knot] * (1.0 + 3.0 * u + 3.0 * u**2 - 3.0 * u**3)
        shape += p[4 + min(knot + 2, KNOTS - 1)] * u**3
        return x[JOINT_TORQUE, j] + p[1] - p[0] * x[ANGLE, j] + shape / 6.0
