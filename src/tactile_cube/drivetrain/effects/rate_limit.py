"""A command whose speed is limited."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.drivetrain.signals import COMMAND

SHARES = (0.8, 0.4, 0.15)
"""Limits at which a search starts, as parts of the fastest command."""


class RateLimit(Effect):
    """Command that the drive lets change only at a limited speed.

    |dq_d / dt| <= speed.

    In data: an error during fast commands only, which ends some time after them.
    Confused with: `torque_saturation`; `actuator_lag`.
    Source: set-point generators of servo drives.
    """

    name = "rate_limit"
    stage = Stage.COMMAND
    parameters = (
        Parameter(
            "speed", unit="rad/s", neutral=1e9, low=0.02, high=1e9, typical=1.0, source="below the fastest command"
        ),
    )

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return limits below the fastest command."""
        return [{"speed": share * scales.command_speed} for share in SHARES]

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Return 2: limited command, first-call flag."""
        return 2

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the command [rad]."""
        if s[1] == 0.0:
            s[0] = x[COMMAND, j]
            s[1] = 1.0
        step = p[0] * dt
        s[0] = s[0] + min(max(x[COMMAND, j] - s[0], -step), step) if abs(x[COMMAND, j] - s[0]) > step else x[COMMAND, j]
        return s[0]
