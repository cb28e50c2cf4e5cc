"""What a recording's URDF says of its joints: names, limits, couplings."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError
from tactile_cube.hand.mjcf import is_mjcf, read_mjcf
from tactile_cube.hand.urdf_tree import read_joints
from tactile_cube.untrusted_file import read_text

LONGEST_WAY = 10.0  # [m] of a sliding joint
CONTROLLER = ("kp", "kd", "torque_limit")
WRONG_ZERO = 0.35  # [rad] a servo that was mounted some teeth off


@dataclass(frozen=True)
class RigJoint:
    """One movable joint of a URDF; where it slides, angles are lengths [m] and torques forces [N]."""

    name: str
    lower: float  # limit [rad], -inf where it has none
    upper: float  # likewise
    mimics: str | None  # the joint that it follows
    prismatic: bool = False
    velocity: float = math.inf  # limit [rad/s], inf where it has none
    effort: float = math.inf  # limit [N m], likewise

    @property
    def bounds(self) -> tuple[float, float]:
        """Where positions are to be expected: the limits, at most a turn or 10 m either way."""
        most = LONGEST_WAY if self.prismatic else 2 * math.pi
        return max(self.lower, -most), min(self.upper, most)

    def beyond(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far values [rad or m] lie outside the bounds; negative inside."""
        lower, upper = self.bounds
        return np.maximum(values - upper, lower - values)

    def reaches(self, values: NDArray[np.float64]) -> bool:
        """Return whether values can be positions of this joint, and are not far outside its bounds."""
        lower, upper = self.bounds
        slack = 0.0 if self.prismatic else WRONG_ZERO
        return bool(np.max(self.beyond(values)) <= 0.5 * (upper - lower) + slack)


@dataclass(frozen=True)
class Rig:
    """The mechanism of a recording."""

    text: str  # the URDF
    path: Path  # the file it was read from
    joints: dict[str, RigJoint]  # movable joints by name
    stated: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # constant of the drives -> joint -> value
    stated_by: str = ""  # who states them, if not the file
    left_out: tuple[str, ...] = ()  # what the file says beside the mechanism and is not used
    unknown: tuple[str, ...] = ()  # of the constants, and `mass`, those that are guesses
    doubts: tuple[str, ...] = ()  # what is guessed of it, for people

    @property
    def gains(self) -> dict[str, Mapping[str, float]]:
        """Stated constants of the controllers."""
        return {key: row for key, row in self.stated.items() if key in CONTROLLER}

    @property
    def nominal(self) -> dict[str, Mapping[str, float]]:
        """Other stated constants of the drives."""
        return {key: row for key, row in self.stated.items() if key not in CONTROLLER}

    def understood(self, joints: Sequence[str]) -> Iterator[tuple[str, str, str]]:
        """Yield what the file states of drives, for display: the quantity, its values, and the source."""
        for key, row in self.stated.items():
            values = [f"{row[joint]:.4g}" for joint in joints if joint in row]
            yield f"{key}", ", ".join(values), f"{self.stated_by or self.path.name}, where you state none"
        for line in self.left_out:
            yield "not used", line, self.path.name


def read_rig(path: Path) -> Rig:
    """Read the mechanism in a URDF, or in an MJCF, which MuJoCo reads.

    Raises:
        InputError: the file is missing or too large, is no URDF or MJCF, or has no movable joint.
    """
    text = read_text(path)
    if not is_mjcf(text):
        return parse_rig(text, path)
    found = read_mjcf(path)
    return replace(parse_rig(found.urdf, path), stated=found.stated, left_out=found.left_out)


def parse_rig(text: str, path: Path) -> Rig:
    """Parse the rig in a URDF's text; error messages name `path`.

    Raises:
        InputError: no URDF, or no robot with a movable joint.
    """
    try:
        joints = [joint for joint in read_joints(text)[0] if joint.movable]
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if not joints:
        raise InputError(f"{path}: not a URDF with movable joints")
    found = {}
    for j in joints:
        leader = j.coupling.joint if j.coupling is not None else None
        found[j.name] = RigJoint(j.name, j.lower, j.upper, leader, j.prismatic, j.velocity, j.effort)
    return Rig(text, path, found)
