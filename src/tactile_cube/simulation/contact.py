"""Contacts of the last physics step, named by what touches what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.hand.model import LINK_NAMES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Contact:
    """One contact point on the cube or between fingers.

    Attributes:
        finger: Name of the finger, or `table` where the cube lies on it.
        link: Name of its link, "" for the table.
        other: What it touches: `cube`, `table` or the name of another finger.
        position: Point on the other body, in the world (3,) [m].
        normal: Unit vector into the other body (3,).
        distance: Gap [m], negative where the bodies overlap.
        force: Normal force [N].
        friction: Friction force on the other body (3,) [N].
    """

    finger: str
    link: str
    other: str
    position: Array
    normal: Array
    distance: float
    force: float
    friction: Array


def read_contact(row: Sequence[Any], names: Mapping[int, str]) -> Contact:
    """A contact from one row of PyBullet's answer.

    Args:
        row: One row of `getContactPoints`.
        names: Name of each body: of a finger, `cube` or `table`.
    """
    first, second = names[row[1]], names[row[2]]
    friction_on_first = row[10] * np.array(row[11]) + row[12] * np.array(row[13])
    normal_on_second = np.array(row[7])
    if first == "cube" or (first == "table" and second != "cube"):
        pose = np.array(row[5])
        return Contact(second, _link(row[4]), first, pose, normal_on_second, row[8], row[9], friction_on_first)
    pose = np.array(row[6])
    return Contact(first, _link(row[3]), second, pose, -normal_on_second, row[8], row[9], -friction_on_first)


def _link(index: int) -> str:
    return LINK_NAMES[index] if index >= 0 else ""
