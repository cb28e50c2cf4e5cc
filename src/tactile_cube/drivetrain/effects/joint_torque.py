"""Torques on the joint that depend smoothly on its motion."""

from dataclasses import replace
from math import isfinite, tanh
from typing import ClassVar

from tactile_cube.drivetrain import signals as sig
from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Scales, Simpler, Stage, unit_at


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
        damping = p[0] + (0.5 * p[1] if x[sig.VELOCITY, j] > 0.0 else -0.5 * p[1])
        x[sig.DAMPING, j] += damping
        return x[sig.JOINT_TORQUE, j] - damping * x[sig.VELOCITY, j]


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
        slope = p[0] * abs(x[sig.VELOCITY, j])
        if p[1] != 2.0:
            slope *= (abs(x[sig.VELOCITY, j]) / p[2]) ** (p[1] - 2.0) if x[sig.VELOCITY, j] != 0.0 else 0.0
        x[sig.DAMPING, j] += p[1] * slope
        return x[sig.JOINT_TORQUE, j] - slope * x[sig.VELOCITY, j]


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
    contains: ClassVar[Simpler] = {"torque_bias": {"stiffness": 0.0}, "cogging": {}, "joint_stop": {}}
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
        place = min(max((x[sig.ANGLE, j] - p[2]) / (p[3] - p[2]) * (KNOTS - 1), 0.0), KNOTS - 1.000001)
        knot = int(place)
        u = place - knot
        shape = p[4 + max(knot - 1, 0)] * (1.0 - u) ** 3
        shape += p[4 + knot] * (4.0 - 6.0 * u**2 + 3.0 * u**3)
        shape += p[5 + knot] * (1.0 + 3.0 * u + 3.0 * u**2 - 3.0 * u**3)
        shape += p[4 + min(knot + 2, KNOTS - 1)] * u**3
        return x[sig.JOINT_TORQUE, j] + p[1] - p[0] * x[sig.ANGLE, j] + shape / 6.0


KINDS = (
    ("damping", "N m s/rad", 1.0, "cables and shared shafts"),
    ("friction", "N m", 0.5, "shared seals"),
    ("stiffness", "N m/rad", 2.0, "tendons across two joints"),
)
FIRST = ("damping", "previous")


class JointCoupling(Effect):
    """Torque on a joint that the motion of its neighbours causes.

    tau_i += damping * v_j + friction * tanh(v_j / rounding) + stiffness * q_j for the previous and the next joint j of
    the chain; the last joint's next one is the first.

    In data: an error of one joint that follows its neighbour's motion.
    Confused with: `torque_crosstalk`, which follows the neighbour's torque.
    Source: Janot et al., Staubli TX40: friction of coupled joints 5 and 6, 1.95 against 0.28 N m.
    """

    name = "joint_coupling"
    stage = Stage.JOINT_TORQUE
    parameters = (
        *(
            Parameter(f"{kind}_{side}", unit, 0.0, -bound, bound, 0.03 if (kind, side) == FIRST else 0.0, source)
            for kind, unit, bound, source in KINDS
            for side in ("previous", "next")
        ),
        Parameter("rounding", unit="rad/s", neutral=0.02, low=1e-3, high=1.0, typical=0.02, source="below any motion"),
    )

    forms = (
        {"damping_previous": 0.03},
        {"damping_next": 0.03},
        {"friction_previous": 0.02},
        {"friction_next": 0.02},
        {"stiffness_previous": 0.05},
        {"stiffness_next": 0.05},
    )

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether the joint has neighbours."""
        return scales.neighbours > 0

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        n = x.shape[1]
        a, b = (j - 1) % n, (j + 1) % n
        torque = x[sig.JOINT_TORQUE, j] + p[0] * x[sig.VELOCITY, a] + p[1] * x[sig.VELOCITY, b]
        torque += p[2] * tanh(x[sig.VELOCITY, a] / p[6]) + p[3] * tanh(x[sig.VELOCITY, b] / p[6])
        return torque + p[4] * x[sig.POSITION, a] + p[5] * x[sig.POSITION, b]


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

    details = ("exponent", "damping")

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """Return how far the joint moved, if not to both of its ends: a stop beyond the motion touches nothing."""
        if scales.low - scales.lower < NEAR * scales.span and scales.upper - scales.high < NEAR * scales.span:
            return None
        ends = f" of {scales.lower:.3g} to {scales.upper:.3g}" if isfinite(scales.upper - scales.lower) else ""
        return f"moved from {scales.low:.3g} to {scales.high:.3g}{ends} {unit_at('rad', scales.slides)}"

    @classmethod
    def parameters_at(cls, scales: Scales) -> dict[str, Parameter]:
        """Return the parameters; a stop lies in its half of the motion, for beyond the middle it would be a spring."""
        known, middle = super().parameters_at(scales), 0.5 * (scales.low + scales.high)
        upper, lower = replace(known["upper"], low=middle), replace(known["lower"], high=middle)
        return known | {"upper": upper, "lower": lower}

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
        over = x[sig.ANGLE, j] - p[0]
        under = p[1] - x[sig.ANGLE, j]
        deep = max(over, under)
        if deep <= 0.0:
            return x[sig.JOINT_TORQUE, j]
        spring = p[2] * deep if p[4] == 1.0 else p[2] * p[5] * (deep / p[5]) ** p[4]
        if over > 0.0:
            return x[sig.JOINT_TORQUE, j] - max(spring + p[3] * x[sig.VELOCITY, j], 0.0)
        return x[sig.JOINT_TORQUE, j] + max(spring - p[3] * x[sig.VELOCITY, j], 0.0)
