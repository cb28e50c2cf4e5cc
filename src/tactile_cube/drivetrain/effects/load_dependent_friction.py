"""Dry friction that grows with the transmitted torque."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION, TORQUE


class LoadDependentFriction(Effect):
    """Dry friction that grows with the transmitted torque.

    F += coefficient * |tau|, tau the torque of the motor.

    In data: steps at reversals that grow with the load.
    Confused with: `torque_gain` where the motor drives the motion under one load; lifting and lowering separate them.
    Source: Duclos et al., BAM: extended friction models for servo actuators, 2025 (models M3-M6).
    """

    name = "load_dependent_friction"
    stage = Stage.FRICTION
    parameters = (
        Parameter("coefficient", "1", 0.0, 0.0, 0.9, 0.1, "0.07-0.3 for small gears"),
    )  # at 1 a gear holds any load

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        return x[FRICTION, j] + p[0] * abs(x[TORQUE, j])
