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
        Parameter(
            "coefficient",
            unit="1",
            neutral=0.0,
            low=0.0,
            high=0.9,  # at 1 a gear holds any load
            typical=0.1,
            source="0.07-0.3 for small gears",
        ),
    )

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        return x[FRICTION, j] + p[0] * abs(x[TORQUE, j])
