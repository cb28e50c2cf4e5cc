"""A gap in the transmission."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Stage
from tactile_cube.drivetrain.signals import MOTOR_POSITION, TORQUE

FLANK_TORQUE = 0.002  # [N m] torque beyond which the gap lies wholly on one side
FLANK_TIME = 0.01  # [s] time to cross the gap; keeps the sampled loop stable


class Backlash(Effect):
    """Play between motor and link, in its two usual descriptions.

    play: the motor encoder keeps its reading until the link has moved through the gap (hysteresis of width
    play). gap: the motor leads by half a gap on the side that the torque pushes to (dead band of the spring);
    the flank changes within 10 ms, so that the loop stays stable.
    Source: Nordin and Gutman, Controlling mechanical systems with backlash, 2002.
    """

    name = "backlash"
    stage = Stage.POSITION_SENSOR
    parameters = (
        Parameter("play", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.01, source="0.1-1 deg"),
        Parameter("gap", unit="rad", neutral=0.0, low=0.0, high=0.15, typical=0.0, source="0.1-1 deg"),
    )

    forms = (
        {"play": 0.01},
        {"gap": 0.01},
    )

    @classmethod
    def state_size(cls, dt: float) -> int:
        """Offset within the play, first-call flag, last reading, offset within the gap."""
        return 4

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Motor position [rad]."""
        reading = x[MOTOR_POSITION, j]
        if p[0] > 0.0:
            half = 0.5 * p[0]
            if s[1] == 0.0:
                s[0] = 0.0
                s[2] = reading
                s[1] = 1.0
            s[0] = min(max(s[0] - (reading - s[2]), -half), half)
            s[2] = reading
            reading += s[0]
        if p[1] > 0.0:
            flank = min(max(x[TORQUE, j] / FLANK_TORQUE, -1.0), 1.0)
            s[3] += (0.5 * p[1] * flank - s[3]) * min(dt / FLANK_TIME, 1.0)
            reading += s[3]
        return reading
