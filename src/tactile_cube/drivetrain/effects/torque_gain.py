"""A motor constant that is not the stated one."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, TORQUE


class TorqueGain(Effect):
    """Torque constant that differs from the stated one.

    tau *= 1 + error.

    In data: an error proportional to the torque.
    Confused with: `payload` and all inertia together; `load_dependent_friction` under one load; a known weight
    separates.
    Source: tolerance of torque constants and current sensors.
    """

    name = "torque_gain"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("error", unit="1", neutral=0.0, low=-0.8, high=1.0, typical=0.1, source="1-15 %"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        x[DAMPING, j] *= 1.0 + p[0]
        return x[TORQUE, j] * (1.0 + p[0])
