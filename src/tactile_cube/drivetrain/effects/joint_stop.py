"""An end stop inside the range of motion."""

from math import isfinite

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales, unit_at
from tactile_cube.drivetrain.signals import ANGLE, JOINT_TORQUE, VELOCITY

SHARES = (0.03, 0.12, 0.3)
"""Distances of a stop from the end of the motion at which a search starts, as parts of the range of motion."""
NEAR = 0.1
"""Largest distance, as a part of the range of motion, at which the motion counts as reaching an end of the joint."""


class JointStop(Effect):
    """End stop inside the range of motion.

    tau -= stiffness * depth * (d / depth)^exponent + damping * v beyond `upper`, at a penetration d; mirrored below
    `lower`. The stop pushes and never pulls. An exponent above 1 is a spring that stiffens.

    In data: a torque only near one end of the motion.
    Confused with: `position_torque`, which acts over the whole range.
    Source: rubber end stops; the exponent: Hunt and Crossley, Coefficient of restitution interpreted as damping in
    vibroimpact, 1975 (their damping is proportional to the penetration, here it is constant).
    """

    name = "joint_stop"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("upper", "rad", 1e9, -7.0, 1e9, 1.0, "within the range of motion", scale=0.05),
        Parameter("lower", "rad", -1e9, -1e9, 7.0, -1e9, "within the range of motion", scale=0.05),
        Parameter("stiffness", unit="N m/rad", neutral=5.0, low=0.1, high=500.0, typical=5.0, source="rubber to metal"),
        Parameter("damping", unit="N m s/rad", neutral=0.0, low=0.0, high=2.0, typical=0.0, source="rubber to metal"),
        Parameter(
            "exponent", unit="1", neutral=1.0, low=0.7, high=3.0, typical=1.0, source="1.5 of spheres", scale=0.3
        ),
        Parameter("depth", unit="rad", neutral=0.05, low=1e-3, high=1.0, typical=0.05, source="some degrees"),
    )

    forms = ({"upper": 1.0, "stiffness": 5.0}, {"lower": -1.0, "stiffness": 5.0})

    details = ("exponent",)

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """Return how far the joint moved, if not to both of its ends: a stop beyond the motion touches nothing."""
        if scales.low - scales.lower < NEAR * scales.span and scales.upper - scales.high < NEAR * scales.span:
            return None
        ends = f" of {scales.lower:.3g} to {scales.upper:.3g}" if isfinite(scales.upper - scales.lower) else ""
        return f"moved from {scales.low:.3g} to {scales.high:.3g}{ends} {unit_at('rad', scales.slides)}"

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return the penetration at which `stiffness` is defined: that of the middle start at the end of the motion.

        With a `depth` far from the penetrations in the data, stiffness and exponent are correlated and a fit of both is
        slow.
        """
        return {"depth": SHARES[1] * scales.span}

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return stops within the range of motion of the recording."""
        inside = [share * scales.span for share in SHARES]
        upper, lower = cls.forms_at(scales)
        return [
            *({**upper, "upper": scales.high - step} for step in inside),
            *({**lower, "lower": scales.low + step} for step in inside),
        ]

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the joint torque [N m]."""
        over = x[ANGLE, j] - p[0]
        under = p[1] - x[ANGLE, j]
        deep = max(over, under)
        if deep <= 0.0:
            return x[JOINT_TORQUE, j]
        spring = p[2] * deep if p[4] == 1.0 else p[2] * p[5] * (deep / p[5]) ** p[4]
        if over > 0.0:
            return x[JOINT_TORQUE, j] - max(spring + p[3] * x[VELOCITY, j], 0.0)
        return x[JOINT_TORQUE, j] + max(spring - p[3] * x[VELOCITY, j], 0.0)
