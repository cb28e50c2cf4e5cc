"""Dry friction that acts as a spring before it slides."""

from math import exp

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import FRICTION, JOINT_TORQUE, VELOCITY


class PreslidingFriction(Effect):
    """Dahl's friction: the bristle deflection z follows the motion and saturates at the friction limit.

    z' = v / breakaway * (1 - z sgn v); torque -(limit + excess) * z. It takes the place of rigid Coulomb
    friction, so the joint creeps elastically below break-away and shows hysteresis loops in (q, tau).
    Source: Dahl, A solid friction model, 1968; Canudas de Wit et al., LuGre, 1995 (its quasi-static part).
    """

    name = "presliding_friction"
    stage = Stage.FRICTION
    contains = ("coulomb_friction",)
    parameters = (
        Parameter("breakaway", unit="rad", neutral=0.0, low=0.0, high=0.1, typical=0.003, source="0.05 mrad to 1 deg"),
        Parameter(
            "excess",
            unit="N m",
            neutral=0.0,
            low=-0.05,
            high=0.5,
            typical=0.0,
            source="friction beyond the nominal static friction",
        ),
    )

    forms = (
        {"breakaway": 0.003},
        {"breakaway": 0.003, "excess": 0.02},
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Bristle deflection z, -1 to 1."""
        return 1

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Rigid friction limit that remains [N m]; the bristles' torque is added to the joint torque."""
        if p[0] <= 0.0:
            return x[FRICTION, j] + p[1]
        limit = max(x[FRICTION, j] + p[1], 0.0)
        direction = 1.0 if x[VELOCITY, j] >= 0.0 else -1.0
        s[0] = direction + (s[0] - direction) * exp(-abs(x[VELOCITY, j]) * dt / p[0])
        x[JOINT_TORQUE, j] -= limit * s[0]
        return 0.0
