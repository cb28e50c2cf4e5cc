"""Dry friction of constant size."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION


class CoulombFriction(Effect):
    """Dry friction of constant size.

    F += friction against the motion, at any speed; the joint sticks under a smaller torque.

    In data: a step in the torque at every reversal, whatever the speed.
    Confused with: `command_dead_zone`; `viscous_friction` at a single speed.
    Source: Olsson et al., Friction models and friction compensation, 1998.
    """

    name = "coulomb_friction"
    stage = Stage.FRICTION
    parameters = (Parameter("friction", "N m", 0.0, 0.0, 0.5, 0.03, "0.01-0.1 N m, 2-10 % of the rating"),)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the friction limit [N m]."""
        return x[FRICTION, j] + p[0]
