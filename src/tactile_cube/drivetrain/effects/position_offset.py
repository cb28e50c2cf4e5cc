"""An encoder whose zero is wrong."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import MOTOR_POSITION


class PositionOffset(Effect):
    """Encoder whose zero is wrong by the same angle in every initialisation.

    q_m += offset.

    In data: a constant error of the position, and an error of the weight's torque like cos q.
    Confused with: the joint offset of an initialisation, `payload`, `torque_bias`.
    Source: Sievers et al., ICRA 2022: joint-angle offsets dominate the model error.
    """

    name = "position_offset"
    constant_reading = "offset"
    stage = Stage.POSITION_SENSOR
    parameters = (Parameter("offset", unit="rad", neutral=0.0, low=-0.3, high=0.3, typical=0.02, source="0.5-3 deg"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor position [rad]."""
        return x[MOTOR_POSITION, j] + p[0]
