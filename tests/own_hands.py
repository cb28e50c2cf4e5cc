"""Hands that are none of the package's own: the shipped pattern with other numbers of fingers and joints."""

from __future__ import annotations

from typing import Any

import yaml

from tactile_cube.composition import CONFIG
from tactile_cube.hand import Hand, hand_from_urdf


def description(which: tuple[str, ...] = ("left", "right", "thumb"), **changes: Any) -> dict[str, Any]:
    """conf/hand/three_finger.yaml with some of its fingers."""
    plain: dict[str, Any] = yaml.safe_load((CONFIG / "hand" / "three_finger.yaml").read_text())
    plain.pop("_target_")
    plain["fingers"] = {name: plain["fingers"][name] for name in which}
    return plain | changes


def own_hand(*fingers: str, **changes: Any) -> Hand:
    """A hand of the pattern; all its fingers where none is named."""
    return hand_from_urdf(**description(fingers or ("left", "right", "thumb"), **changes))
