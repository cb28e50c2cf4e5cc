"""Torque on a joint that its neighbours' motion causes."""

from math import tanh

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import JOINT_TORQUE, POSITION, VELOCITY


class JointCoupling(Effect):
    """tau_i += f(v_j, q_j) of the previous and the next joint of the chain (taken in a ring).

    Viscous (damping), dry (friction, rounded below the speed `rounding`) and elastic (stiffness) parts.
    Source: Janot et al., Staubli TX40: friction of coupled joints 5 and 6, 1.95 against 0.28 N m.
    """

    name = "joint_coupling"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter(
            "damping_previous",
            unit="N m s/rad",
            neutral=0.0,
            low=-1.0,
            high=1.0,
            typical=0.03,
            source="cables and shared shafts",
        ),
        Parameter(
            "damping_next",
            unit="N m s/rad",
            neutral=0.0,
            low=-1.0,
            high=1.0,
            typical=0.0,
            source="cables and shared shafts",
        ),
        Parameter("friction_previous", unit="N m", neutral=0.0, low=-0.5, high=0.5, typical=0.0, source="shared seals"),
        Parameter("friction_next", unit="N m", neutral=0.0, low=-0.5, high=0.5, typical=0.0, source="shared seals"),
        Parameter(
            "stiffness_previous",
            unit="N m/rad",
            neutral=0.0,
            low=-2.0,
            high=2.0,
            typical=0.0,
            source="tendons across two joints",
        ),
        Parameter(
            "stiffness_next",
            unit="N m/rad",
            neutral=0.0,
            low=-2.0,
            high=2.0,
            typical=0.0,
            source="tendons across two joints",
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
        """Only where there are neighbours."""
        return scales.neighbours > 0

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Joint torque [N m]."""
        n = x.shape[1]
        a, b = (j - 1) % n, (j + 1) % n
        torque = x[JOINT_TORQUE, j] + p[0] * x[VELOCITY, a] + p[1] * x[VELOCITY, b]
        torque += p[2] * tanh(x[VELOCITY, a] / p[6]) + p[3] * tanh(x[VELOCITY, b] / p[6])
        return torque + p[4] * x[POSITION, a] + p[5] * x[POSITION, b]
