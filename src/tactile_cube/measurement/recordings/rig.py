"""What a recording's URDF says of its joints: names, limits, couplings."""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.errors import InputError

MOVABLE = ("revolute", "continuous", "prismatic")
LONGEST_WAY = 10.0  # [m] of a sliding joint
WRONG_ZERO = 0.35  # [rad] a servo that was mounted some teeth off


@dataclass(frozen=True)
class RigJoint:
    """One movable joint of a URDF.

    Attributes:
        name: in the URDF.
        lower: limit [rad] ([m] where it slides), -inf where it has none.
        upper: likewise.
        mimics: the joint that it follows.
        prismatic: it slides.
        velocity: limit of its speed [rad/s] ([m/s]), inf where it has none.
        effort: limit of its torque [N m] ([N]), likewise.
    """

    name: str
    lower: float
    upper: float
    mimics: str | None
    prismatic: bool = False
    velocity: float = math.inf
    effort: float = math.inf

    @property
    def bounds(self) -> tuple[float, float]:
        """Where positions are to be expected: the limits, at most a turn or 10 m either way."""
        most = LONGEST_WAY if self.prismatic else 2 * math.pi
        return max(self.lower, -most), min(self.upper, most)

    def beyond(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far values [rad or m] lie outside the bounds; negative inside."""
        lower, upper = self.bounds
        return np.maximum(values - upper, lower - values)

    def reaches(self, values: NDArray[np.float64]) -> bool:
        """Whether values can be positions of this joint, or are far outside its bounds."""
        lower, upper = self.bounds
        slack = 0.0 if self.prismatic else WRONG_ZERO
        return bool(np.max(self.beyond(values)) <= 0.5 * (upper - lower) + slack)


@dataclass(frozen=True)
class Rig:
    """The mechanism of a recording.

    Attributes:
        text: the URDF.
        path: the file it was read from.
        joints: movable joints by name.
    """

    text: str
    path: Path
    joints: dict[str, RigJoint]


def read_rig(path: Path) -> Rig:
    """The URDF at `path`.

    Raises:
        InputError: the file is missing, no XML, or no robot with a movable joint.
    """
    try:
        return parse_rig(path.read_text(encoding="utf-8"), path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; recording.yaml names it under 'rig'") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a URDF: {error}") from None


def parse_rig(text: str, path: Path) -> Rig:
    """The rig in a URDF's text; `path` is what errors name.

    Raises:
        InputError: no XML, or no robot with a movable joint.
    """
    try:
        root = ElementTree.fromstring(text)
        joints = {joint.name: joint for joint in map(_joint, root.iter("joint")) if joint is not None}
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"{path}: not a URDF: {error}") from None
    if root.tag != "robot" or not joints:
        raise InputError(f"{path}: not a URDF with movable joints (root element <{root.tag}>)")
    return Rig(text, path, joints)


def _joint(element: ElementTree.Element) -> RigJoint | None:
    kind = element.get("type", "")
    if kind not in MOVABLE:
        return None
    limit, mimic = element.find("limit"), element.find("mimic")
    bounded = limit is not None and kind != "continuous"
    name = element.get("name", "")
    lower, upper = -math.inf, math.inf
    if bounded and limit is not None:
        lower, upper = _number(limit, "lower", name, lower), _number(limit, "upper", name, upper)
    leader = mimic.get("joint") if mimic is not None else None
    velocity, effort = (_strength(limit, key, name) for key in ("velocity", "effort"))
    return RigJoint(name, lower, upper, leader, kind == "prismatic", velocity, effort)


def _strength(limit: ElementTree.Element | None, key: str, joint: str) -> float:
    """A limit of speed or torque; exporters write 0 where they know none."""
    value = math.inf if limit is None else _number(limit, key, joint, math.inf)
    return value if value > 0.0 else math.inf


def _number(limit: ElementTree.Element, key: str, joint: str, default: float) -> float:
    text = limit.get(key)
    try:
        return default if text is None else float(text)
    except ValueError:
        raise ValueError(f"joint '{joint}': limit {key}='{text}' is no number") from None
