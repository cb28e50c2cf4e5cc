"""The mechanism of logs: a URDF or MJCF, or one joint without either, and the servo that drives it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_cube.composition import CONFIG, suggestion
from tactile_cube.drivetrain.model_file import Strict
from tactile_cube.drivetrain.plain_yaml import read_schema
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import PerJoint, Positive, per_joint
from tactile_cube.measurement.recordings.rig import Rig, read_rig
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.sources.lever import ROBOTS, Lever
from tactile_cube.measurement.sources.source import with_stated


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
        """Return kp [N m/rad], kd of the back-EMF, torque_limit and reflected_inertia at a firmware's gain."""
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


@dataclass(frozen=True)
class Mechanism:
    """What is said of it; conf/source/csv.yaml says what each setting means, and its units."""

    urdf: str | None
    robot: str | None
    mass: Positive | None
    lever: Positive | None
    servo: str | None
    gain: Positive | None

    def rig(self) -> Rig:
        """Return it, with the servo's constants in the place of what a file states of drives.

        Raises:
            InputError: neither a file nor a robot, or both; a file, a robot or a servo that cannot be used.
        """
        if (self.urdf is None) == (self.robot is None):
            raise InputError(
                "source=csv needs either source.urdf=... (of the rig, or its MJCF) or, for one joint without one, "
                f"source.robot={'|'.join(ROBOTS)}"
            )
        for key, whose in {"mass": "robot", "lever": "robot", "gain": "servo"}.items():
            if getattr(self, key) is not None and getattr(self, whose) is None:
                raise InputError(
                    f"source.{key}={getattr(self, key):g}: is that of source.{whose}=NAME, which is not given"
                )
        rig = Lever(str(self.robot), self.mass, self.lever).rig() if self.urdf is None else read_rig(Path(self.urdf))
        if self.servo is None:
            return rig
        constants = read_servo(self.servo).constants(self.gain)
        stated = {**rig.stated, **{key: dict.fromkeys(rig.joints, value) for key, value in constants.items()}}
        doubt = f"constants of the servo {self.servo} are those of another unit; its kd and rotor are identified"
        return replace(
            rig, stated=stated, stated_by=f"servo {self.servo}", unknown=("kd", "reflected_inertia"), doubts=(doubt,)
        )

    def sized(self, rig: Rig, trials: Sequence[TrialTable], mode: str, kp: PerJoint | None, gravity: float) -> Rig:
        """Return the rig with masses that logs show where nobody says them; see `Lever.sized`."""
        if self.robot is None:
            return rig
        said = with_stated({"kp": kp}, rig.gains, [self.robot]).get("kp")
        try:
            gain = None if said is None else float(per_joint(said, (self.robot,), "source.controller.kp")[0])
        except ValueError as error:
            raise InputError(str(error)) from None
        sized = Lever(str(self.robot), self.mass, self.lever).sized(trials, mode, gain, gravity)
        return replace(
            sized,
            stated={**sized.stated, **rig.stated},
            stated_by=rig.stated_by or sized.stated_by,
            unknown=tuple(dict.fromkeys([*sized.unknown, *rig.unknown])),
            doubts=(*rig.doubts, *sized.doubts),
        )
