"""One joint whose mechanism nobody describes: pendulum, wheel or slide, with sizes that its own log shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.rig import Rig, parse_rig
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.sources.gains import motion_of, nonnegative_fit, resistance

Array = NDArray[np.float64]
ROBOTS = {
    "pendulum": "turns about a level axis and has a weight",
    "wheel": "turns, and gravity does nothing",
    "slide": "slides on a level rail",
}
LEVER = 0.1  # [m] from the axis to the mass, a guess
UNIT_GAIN = 1.0  # [N m/rad] in the place of a gain that nobody states: everything else is in proportion to it
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


@dataclass(frozen=True)
class Lever:
    """What is known of such a joint."""

    robot: str  # one of ROBOTS, also the joint's name
    mass: float | None = None  # at the end of the lever, of a wheel that of its rim [kg]
    lever: float | None = None  # from the axis to the mass [m]

    def __post_init__(self) -> None:
        """Refuse another robot."""
        if self.robot not in ROBOTS:
            raise InputError(
                f"source.robot={self.robot}: unknown; choose one of {', '.join(ROBOTS)}, or give source.urdf"
            )

    def rig(self, mass: float = 1.0, lever: float = LEVER, hangs_at: float = 0.0) -> Rig:
        """Return it as a mechanism; of a pendulum that hangs down at an angle [rad]."""
        size = lever**2 if self.robot == "wheel" else 1e-3 * lever**2
        text = URDF.format(
            robot=self.robot, kind="prismatic" if self.robot == "slide" else "continuous", axis=AXES[self.robot],
            mass=mass, com=-lever if self.robot == "pendulum" else 0.0, own=mass * size, turned=-hangs_at or 0.0,
        )  # fmt: skip
        return parse_rig(text, Path(f"{self.robot}.urdf"))

    def sized(self, trials: Sequence[TrialTable], mode: str, kp: float | None, gravity: float) -> Rig:
        """Return it with the masses that logs of this joint show under gravity [m/s^2], and what stays unknown."""
        found = _seen(trials, mode, self.robot == "pendulum", kp or UNIT_GAIN)
        if self.mass is not None:
            rig = self.rig(self.mass, self.lever or LEVER, found.hangs_at)
            return replace(rig, doubts=self._doubts(found, ""))
        inertia = max(found.inertia, 1e-9 * (kp or UNIT_GAIN))
        mass, lever = self._link(found, inertia, gravity)
        scale = 1.0 / mass if mode == "free" else 1.0
        of_link = mass if self.robot == "slide" else mass * lever**2
        guessed = {"reflected_inertia": max(inertia - of_link, 0.1 * of_link) * scale}
        unknown = ["reflected_inertia"]
        if mode != "free" and self.robot == "pendulum":
            unknown.append("mass")
        if mode == "position":
            guessed |= {"kd": max(found.damping, 0.01 * (kp or UNIT_GAIN))}
            guessed |= {} if kp else {"kp": UNIT_GAIN}
            unknown.append("kd")
        open_ = "no torque is known" if mode == "free" else ""
        if mode == "position" and not kp:
            open_ = f"kp is not stated, {UNIT_GAIN:g} N m/rad is a guess"
        stated = {key: {self.robot: float(f"{value:.4g}")} for key, value in guessed.items()}
        rig = self.rig(mass * scale, lever, found.hangs_at)
        doubts = self._doubts(found, open_)
        return replace(rig, stated=stated, stated_by="the log", unknown=tuple(unknown), doubts=doubts)

    def _link(self, found: _Seen, inertia: float, gravity: float) -> tuple[float, float]:
        """Mass [kg] and lever [m] of the link: a part of the inertia, and the weight."""
        own = OF_LINK[self.robot] * inertia
        if self.robot == "slide":
            return own, LEVER
        if self.robot == "wheel" or found.weight <= 0.0:
            lever = self.lever or LEVER
            return own / lever**2, lever
        lever = self.lever or min(LEVER, own * gravity / found.weight)
        return found.weight / (gravity * lever), lever

    def _doubts(self, found: _Seen, scale: str) -> tuple[str, ...]:
        guessed = f"no URDF: mass, lever and rotor of the {self.robot} are guesses from the log, and are identified"
        light = self.robot == "pendulum" and found.weight <= NO_WEIGHT * found.drive
        lines = {
            guessed: self.mass is None,
            f"{scale}: of torques, gains and inertias only the ratios are known": scale,
            "the log shows no weight: is it a wheel (source.robot=wheel)?": light,
            f"by the log the pendulum hangs down at {found.hangs_at:.3g} rad, not at 0": found.hangs_at,
        }
        return tuple(line for line, holds in lines.items() if holds)


@dataclass(frozen=True)
class _Seen:
    inertia: float = 0.0  # [kg m^2]
    weight: float = 0.0  # m g l [N m]
    damping: float = 0.0  # [N m s/rad]
    hangs_at: float = 0.0  # angle at which a pendulum hangs down [rad]
    drive: float = 0.0  # usual torque [N m]


def _seen(trials: Sequence[TrialTable], mode: str, weighs: bool, kp: float) -> _Seen:
    """Nonnegative least squares of the torque of the drive, or without one of the acceleration."""
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
