"""Servos by their names: constants that others have published, in conf/servo."""

from __future__ import annotations

from tactile_cube.composition import CONFIG, suggestion
from tactile_cube.drivetrain.model_file import Strict
from tactile_cube.drivetrain.plain_yaml import read_schema
from tactile_cube.errors import InputError


class Servo(Strict):
    """A DC motor behind gears under a firmware that sets its duty in proportion to the error; conf/servo has units."""

    kt: float
    R: float
    volts: float
    duty_per_gain: float
    most_duty: float
    reflected_inertia: float
    gain: float

    def constants(self, gain: float | None) -> dict[str, float]:
        """Return kp [N m/rad], kd [N m s/rad] of the back-EMF, torque_limit [N m] and reflected_inertia [kg m^2].

        Args:
            gain: of the firmware; None: the usual one.
        """
        stall = self.volts * self.kt / self.R
        kp = (self.gain if gain is None else gain) * self.duty_per_gain * stall
        values = {"kp": kp, "kd": self.kt**2 / self.R, "torque_limit": self.most_duty * stall}
        return {
            key: float(f"{one:.4g}") for key, one in (values | {"reflected_inertia": self.reflected_inertia}).items()
        }


def servos() -> list[str]:
    """Return the names of conf/servo."""
    return sorted(path.stem for path in (CONFIG / "servo").glob("*.yaml"))


def read_servo(name: str) -> Servo:
    """Return a servo.

    Raises:
        InputError: there is none of this name.
    """
    if name not in servos():
        raise InputError(f"source.servo={name}: unknown; there are {', '.join(servos())}{suggestion(name, servos())}")
    return read_schema(CONFIG / "servo" / f"{name}.yaml", Servo)
