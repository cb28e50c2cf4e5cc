"""Dry friction that acts as a spring before it slides."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import DAMPING, FRICTION, JOINT_TORQUE, VELOCITY


class PreslidingFriction(Effect):
    """Dry friction on bristles, which act as a spring before the joint slides (Dahl, LuGre).

    z' = v / breakaway * (1 - z sgn v) is the bristles' deflection, -1 to 1; their torque is -(limit + excess) * z -
    micro_damping * breakaway * z'. It replaces rigid dry friction with its limit: the joint creeps elastically below
    break-away, with hysteresis between position and torque. Damped bristles (LuGre) add drag where the motion turns
    round, and none while it slides.

    In data: closed loops of torque over position in small motion, the same at any speed.
    Confused with: `elasticity` and `backlash` in motion of one amplitude.
    Source: Dahl, A solid friction model, 1968; Canudas de Wit et al., A new model for control of systems with friction,
    1995 (without their Stribeck curve).
    """

    name = "presliding_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("breakaway", unit="rad", neutral=0.0, low=0.0, high=0.1, typical=0.003, source="0.05 mrad to 1 deg"),
        Parameter("excess", "N m", 0.0, -0.05, 0.5, 0.0, "friction beyond the nominal static friction"),
        Parameter("micro_damping", "N m s/rad", 0.0, 0.0, 2.0, 0.0, "0.5-1 of critical damping on the bristles"),
    )

    forms = (
        {"breakaway": 0.003},
        {"breakaway": 0.003, "excess": 0.02},
        {"breakaway": 0.003, "excess": 0.02, "micro_damping": 0.1},
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 1: the bristle deflection z, -1 to 1."""
        return 1

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the rigid friction limit that remains [N m]; add the bristles' torque to the joint torque."""
        if p[0] <= 0.0:
            return x[FRICTION, j] + p[1]
        limit = max(x[FRICTION, j] + p[1], 0.0)
        direction = 1.0 if x[VELOCITY, j] >= 0.0 else -1.0
        s[0] = direction + (s[0] - direction) * exp(-abs(x[VELOCITY, j]) * dt / p[0])
        drag = p[2] * (1.0 - direction * s[0])
        x[DAMPING, j] += drag
        x[JOINT_TORQUE, j] -= limit * s[0] + drag * x[VELOCITY, j]
        return 0.0
