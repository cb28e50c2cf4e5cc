"""A controller that carries a part of the links' weight by itself."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import TORQUE, WEIGHT


class GravityCompensation(Effect):
    """Controller that carries a part of the links' weight by itself.

    tau += share * g(q), where g is the torque that holds the model's links against gravity at their posture.

    In data: the joint sags less than its weight and its stiffness say, in every posture.
    Confused with: `payload`: less load than stated, or a counterweight; a torque sensor separates them. `mount_tilt`,
    `torque_gain` in slow motion.
    Source: Takegaki and Arimoto, A new feedback method for dynamic control of manipulators, 1981 (PD with gravity
    compensation).
    """

    name = "gravity_compensation"
    stage = Stage.MOTOR_TORQUE
    parameters = (Parameter("share", "1", 0.0, -0.5, 1.5, 0.8, "0 none, 1 all of it"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the motor torque [N m]."""
        return x[TORQUE, j] + p[0] * x[WEIGHT, j]
