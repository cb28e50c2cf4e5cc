"""The mechanism of logs: a URDF or MJCF, or one joint without either, and the servo that drives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import PerJoint, per_joint
from tactile_cube.measurement.recordings.rig import Rig, read_rig
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.sources.lever import ROBOTS, Lever
from tactile_cube.measurement.sources.servo import read_servo
from tactile_cube.measurement.sources.source import with_stated


@dataclass(frozen=True)
class Mechanism:
    """What is said of it; conf/source/csv.yaml says what each setting means, and its units."""

    urdf: str | None
    robot: str | None
    mass: float | None
    lever: float | None
    servo: str | None
    gain: float | None

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
        rig = self._lever().rig() if self.urdf is None else read_rig(Path(self.urdf))
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
        sized = self._lever().sized(trials, mode, gain, gravity)
        return replace(
            sized,
            stated={**sized.stated, **rig.stated},
            stated_by=rig.stated_by or sized.stated_by,
            unknown=tuple(dict.fromkeys([*sized.unknown, *rig.unknown])),
            doubts=(*rig.doubts, *sized.doubts),
        )

    def _lever(self) -> Lever:
        return Lever(str(self.robot), self.mass, self.lever)
