"""A constant torque that nobody commanded."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import TORQUE


class TorqueBias(Effect):
    """Constant torque that nobody commanded.

    tau += bias.

    In data: a constant error of the torque, at rest too.
    Confused with: `asymmetric_friction` while the joint moves; `payload` in one posture; `position_offset`.
    Source: offsets of current and torque sensors.
    """

    name = "torque_bias"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("bias", unit="N m", neutral=0.0, low=-0.5, high=0.5, typical=0.005, source="1-10 mN m"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        return x[TORQUE, j] + p[0]
