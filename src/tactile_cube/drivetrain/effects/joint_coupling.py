"""Torque on a joint that its neighbours' motion causes."""

from math import tanh

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import JOINT_TORQUE, POSITION, VELOCITY

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
        """Return the joint torque [N m]."""
        n = x.shape[1]
        a, b = (j - 1) % n, (j + 1) % n
        torque = x[JOINT_TORQUE, j] + p[0] * x[VELOCITY, a] + p[1] * x[VELOCITY, b]
        torque += p[2] * tanh(x[VELOCITY, a] / p[6]) + p[3] * tanh(x[VELOCITY, b] / p[6])
        return torque + p[4] * x[POSITION, a] + p[5] * x[POSITION, b]
