"""The mechanism of logs: a URDF or MJCF, or one joint that nobody describes, sized by its own log, and its servo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tactile_cube.composition import CONFIG, suggestion
from tactile_cube.drivetrain.model_file import Strict
from tactile_cube.drivetrain.plain_yaml import read_schema
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import PerJoint, Positive, per_joint
from tactile_cube.measurement.recordings.rig import Rig, parse_rig, read_rig
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.sources.gains import motion_of, nonnegative_fit, resistance
from tactile_cube.measurement.sources.source import with_stated

ROBOTS = {
    "pendulum": "turns about a level axis and has a weight",
    "wheel": "turns, and gravity does nothing",
    "slide": "slides on a level rail",
}
LEVER = 0.1  # [m] from the axis to the mass, a guess
UNIT_GAIN = 1.0  # [N m/rad] used for a gain that is not stated: everything else is in proportion to it
OF_LINK = {"pendulum": 0.5, "wheel": 0.1, "slide": 0.1}
"""Part of the inertia that is the link's; the rest, free, is the rotor's."""
HANGS = 0.837  # part of the error that must be left for another zero than that of the log
FEWEST = 20  # samples
NO_WEIGHT = 0.02  # part of the drive's torque that a weight must be
URDF = """<?xml version="1.0"?>
<robot name="{robot}"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 {com:.9g}"/><mass value="{mass:.9g}"/>
<inertia ixx="{own:.9g}" iyy="{own:.9g}" izz="{own:.9g}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{robot}" type="{kind}"><parent link="base"/><child link="arm"/><origin xyz="0 0 0" rpy="0 {turned:.9g} 0"/>
<axis xyz="{axis}"/></joint></robot>
"""
AXES = {"pendulum": "0 1 0", "wheel": "0 0 1", "slide": "1 0 0"}


def lever_rig(robot: str, mass: float = 1.0, lever: float = LEVER, hangs_at: float = 0.0) -> Rig:
    """Return one of ROBOTS (else an InputError): a mass [kg], of a wheel its rim's, at a lever [m] from the axis.

    A pendulum hangs down at an angle [rad].
    """
    if robot not in ROBOTS:
        raise InputError(f"source.robot={robot}: unknown; choose one of {', '.join(ROBOTS)}, or give source.urdf")
    text = URDF.format(
        robot=robot, kind="prismatic" if robot == "slide" else "continuous", axis=AXES[robot],
        mass=mass, com=-lever if robot == "pendulum" else 0.0, turned=-hangs_at or 0.0,
        own=mass * (lever**2 if robot == "wheel" else 1e-3 * lever**2),
    )  # fmt: skip
    return parse_rig(text, Path(f"{robot}.urdf"))


@dataclass(frozen=True)
class _Seen:
    inertia: float = 0.0  # [kg m^2]
    weight: float = 0.0  # m g l [N m]
    damping: float = 0.0  # [N m s/rad]
    hangs_at: float = 0.0  # angle at which a pendulum hangs down [rad]
    drive: float = 0.0  # usual torque [N m]


def _seen(trials: Sequence[TrialTable], mode: str, weighs: bool, kp: float) -> _Seen:
    """Fit the torque of the drive, or without one the acceleration, by nonnegative least squares."""
    motion = motion_of(trials, 1)
    if len(motion) < FEWEST:
        return _Seen()
    q, v, a, error, command = motion[:, :, 0].T
    drive = {"position": kp * error, "free": -a}.get(mode, command)
    columns = resistance(v) | ({} if mode == "free" else {"inertia": a}) | ({"sin": np.sin(q)} if weighs else {})
    found, left = nonnegative_fit(columns, drive)
    if weighs:
        turned, rest = nonnegative_fit(columns | {"cos": np.cos(q), "anti": -np.cos(q)}, drive)
        found = turned if rest < HANGS * left else found
    across = found.get("cos", 0.0) - found.get("anti", 0.0)
    weight, along = float(np.hypot(found.get("sin", 0.0), across)), found.get("sin", 0.0)
    hangs_at = float(round(-np.arctan2(across, along), 3)) if across else 0.0
    return _Seen(found.get("inertia", 1.0), weight, found["damping"], hangs_at, float(np.std(drive)))


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
    """Stated mechanism of the logs; conf/source/csv.yaml says what each setting means, and its units."""

    urdf: str | None
    robot: str | None
    mass: Positive | None
    lever: Positive | None
    servo: str | None
    gain: Positive | None

    def rig(self) -> Rig:
        """Return the rig, with the servo's constants in the place of what a file states of drives.

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
        rig = lever_rig(str(self.robot)) if self.urdf is None else read_rig(Path(self.urdf))
        if self.servo is None:
            return rig
        constants = read_servo(self.servo).constants(self.gain)
        stated = {**rig.stated, **{key: dict.fromkeys(rig.joints, value) for key, value in constants.items()}}
        # beside a mass that is a guess, the gain is the scale of everything
        unknown = ("kp", "kd", "reflected_inertia")[self.robot is not None and self.mass is None :]
        doubt = f"constants of the servo {self.servo} are those of another unit; {', '.join(unknown)} are identified"
        return replace(rig, stated=stated, stated_by=f"servo {self.servo}", unknown=unknown, doubts=(doubt,))

    def sized(self, rig: Rig, trials: Sequence[TrialTable], mode: str, kp: PerJoint | None, gravity: float) -> Rig:
        """Return the mechanism with the masses that logs show under gravity [m/s^2] where none are stated."""
        if self.robot is None:
            return rig
        said = with_stated({"kp": kp}, rig.gains, [self.robot]).get("kp")
        try:
            known = None if said is None else float(per_joint(said, (self.robot,), "source.controller.kp")[0])
        except ValueError as error:
            raise InputError(str(error)) from None
        gain = known or UNIT_GAIN
        found, open_ = _seen(trials, mode, self.robot == "pendulum", gain), ""
        mass, lever, guessed, unknown = self.mass, self.lever or LEVER, dict[str, float](), list[str]()
        if mass is None:
            inertia = max(found.inertia, 1e-9 * gain)
            mass, lever = self._link(found, inertia, gravity)
            scale = 1.0 / mass if mode == "free" else 1.0
            of_link = mass if self.robot == "slide" else mass * lever**2
            guessed = {"reflected_inertia": max(inertia - of_link, 0.1 * of_link) * scale}
            unknown = ["reflected_inertia", *["mass"] * (mode != "free" and self.robot == "pendulum")]
            if mode == "position":
                guessed |= {"kd": max(found.damping, 0.01 * gain)} | ({} if known else {"kp": UNIT_GAIN})
                unknown.append("kd")
            mass *= scale
            open_ = "no torque is known" if mode == "free" else ""
            if mode == "position" and not known:
                open_ = f"kp is not stated, {UNIT_GAIN:g} N m/rad is a guess"
        guess = f"no URDF: mass, lever and rotor of the {self.robot} are guesses from the log, and are identified"
        light = self.robot == "pendulum" and found.weight <= NO_WEIGHT * found.drive
        doubts = {
            guess: self.mass is None,
            f"{open_}: of torques, gains and inertias only the ratios are known": open_,
            "the log shows no weight: is it a wheel (source.robot=wheel)?": light,
            f"by the log the pendulum hangs down at {found.hangs_at:.3g} rad, not at 0": found.hangs_at,
        }
        return replace(
            lever_rig(self.robot, mass, lever, found.hangs_at),
            stated={key: {self.robot: float(f"{value:.4g}")} for key, value in guessed.items()} | dict(rig.stated),
            stated_by=rig.stated_by or ("the log" if guessed else ""),
            unknown=tuple(dict.fromkeys([*unknown, *rig.unknown])),
            doubts=(*rig.doubts, *(line for line, holds in doubts.items() if holds)),
        )

    def _link(self, found: _Seen, inertia: float, gravity: float) -> tuple[float, float]:
        """Return the mass [kg] and lever [m] of the link: a part of the inertia, and the weight."""
        own = OF_LINK[str(self.robot)] * inertia
        if self.robot == "slide":
            return own, LEVER
        if self.robot == "wheel" or found.weight <= 0.0:
            lever = self.lever or LEVER
            return own / lever**2, lever
        lever = self.lever or min(LEVER, own * gravity / found.weight)
        return found.weight / (gravity * lever), lever
