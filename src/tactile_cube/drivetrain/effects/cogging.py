"""A torque ripple that repeats with the position."""

from collections.abc import Mapping
from math import cos, pi, sin

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.harmonic import harmonic
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import ANGLE, JOINT_TORQUE, TORQUE

RIPPLE = "1-5 % of the rating"
REPEATS = 1.5  # periods in the range of motion from which a ripple is seen to repeat
OVERTONES = ("sine_2", "cosine_2", "sine_3", "cosine_3")


class Cogging(Effect):
    """Torque ripple that repeats with the position.

    tau += sine * sin(harmonic q) + cosine * cos(harmonic q) in the motor; `joint_sine` and `joint_cosine` act at the
    joint instead. A ripple of the motor also bends the drive's elasticity; one of a gear's last stage or of a bearing
    does not. Waves of twice and three times the harmonic act where the first one does.

    In data: a comb over the position, not over time.
    Confused with: `transmission_error`, which needs no torque; slow motion both ways at two loads separates them.
    Source: Holtz and Springob, Identification and compensation of torque ripple, 1996.
    """

    name = "cogging"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("sine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.01, source=RIPPLE),
        Parameter("cosine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        harmonic(source="poles times gear ratio"),
        Parameter("joint_sine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        Parameter("joint_cosine", unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source=RIPPLE),
        *(
            Parameter(name, unit="N m", neutral=0.0, low=-0.3, high=0.3, typical=0.0, source="slots, saturation")
            for name in OVERTONES
        ),
    )

    forms = (
        {"sine": 0.01, "cosine": 0.0, "harmonic": 10.0},
        {"joint_sine": 0.01, "joint_cosine": 0.0, "harmonic": 10.0},
    )
    details = OVERTONES

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return the overtones if the ripple repeats in the motion; three waves fit any torque that does not repeat."""
        repeats = values["harmonic"] * scales.span / (2.0 * pi)
        return cls.details if repeats >= REPEATS else ()

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the joint torque [N m]."""
        angle = p[2] * x[ANGLE, j]
        if p[3] == 0.0 and p[4] == 0.0:
            return x[JOINT_TORQUE, j]
        ripple = p[3] * sin(angle) + p[4] * cos(angle)
        ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[JOINT_TORQUE, j] + ripple

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        angle = p[2] * x[ANGLE, j]
        ripple = p[0] * sin(angle) + p[1] * cos(angle)
        if p[3] == 0.0 and p[4] == 0.0:
            ripple += p[5] * sin(2 * angle) + p[6] * cos(2 * angle) + p[7] * sin(3 * angle) + p[8] * cos(3 * angle)
        return x[TORQUE, j] + ripple
