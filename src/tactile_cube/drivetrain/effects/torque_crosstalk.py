"""A joint that feels part of its neighbours' torque."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import TORQUE


class TorqueCrosstalk(Effect):
    """Part of the neighbours' torque that reaches a joint.

    tau_i += from_previous * tau_(i-1) + from_next * tau_(i+1); the last joint's next one is the first.

    In data: an error proportional to a neighbour's torque.
    Confused with: `joint_coupling`, which follows the neighbour's motion.
    Source: tendons routed over neighbouring joints; cross-coupling of torque sensors.
    """

    name = "torque_crosstalk"
    stage = Stage.MOTOR_TORQUE
    parameters = (
        Parameter("from_previous", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.05, source="1-15 %"),
        Parameter("from_next", unit="1", neutral=0.0, low=-0.9, high=0.9, typical=0.0, source="1-15 %"),
    )

    forms = ({"from_previous": 0.05}, {"from_next": 0.05})

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether the joint has neighbours."""
        return scales.neighbours > 0

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        n = x.shape[1]
        return x[TORQUE, j] + p[0] * x[TORQUE, (j - 1) % n] + p[1] * x[TORQUE, (j + 1) % n]
