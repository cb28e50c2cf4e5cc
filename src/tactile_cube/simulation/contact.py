"""Contacts of the last physics step, named by what touches what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.simulation.constants import EpisodeConstants

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


def read_contact(row: Sequence[Any], names: Mapping[int, str], links: Mapping[int, Sequence[str]]) -> Contact:
    """A contact from one row of PyBullet's answer.

    Args:
        row: One row of `getContactPoints`.
        names: Name of each body: of a finger, `cube` or `table`.
        links: Names of the links of each finger.
    """
    friction_on_first = row[10] * np.array(row[11]) + row[12] * np.array(row[13])
    return named_contact(
        bodies=(names[row[1]], names[row[2]]),
        links=(_link(row[3], links.get(row[1], ())), _link(row[4], links.get(row[2], ()))),
        middle=0.5 * (np.array(row[5]) + np.array(row[6])),
        normal=-np.array(row[7]),
        distance=row[8],
        force=row[9],
        friction=-friction_on_first,
    )


def named_contact(
    bodies: tuple[str, str],
    links: tuple[str, str],
    middle: Array,
    normal: Array,
    distance: float,
    force: float,
    friction: Array,
) -> Contact:
    """A contact told from the side of the finger; of the table where no finger takes part.

    Args:
        bodies: Names of the first and the second body: of a finger, `cube` or `table`.
        links: Names of their links, "" where there is none.
        middle: Point between the two surfaces, in the world (3,) [m].
        normal: Unit vector from the first into the second (3,).
        distance: Gap [m].
        force: Normal force [N].
        friction: Friction force on the second (3,) [N].
    """
    (first, second), (link, other_link) = bodies, links
    if first == "cube" or (first == "table" and second != "cube"):
        first, second, link, normal, friction = second, first, other_link, -normal, -friction
    link = "" if first == "table" else link
    return Contact(first, link, second, middle + 0.5 * distance * normal, normal, distance, force, friction)


def _link(index: int, names: Sequence[str]) -> str:
    return names[index] if 0 <= index < len(names) else ""


SKIN_RELAXATION = 5e-3
"""Damping over stiffness of a fingertip's skin [s]: rubber settles within a few ms."""


@dataclass(frozen=True)
class Surface:
    """A body's side of a contact.

    Attributes:
        lateral: Factor of Coulomb friction.
        spinning: Torque against spinning per normal force [m], on a body whose factor is 1.
        compliance: How far it gives way per normal force [m/N]; 0: hard.
    """

    lateral: float
    spinning: float = 0.0
    compliance: float = 0.0

    def on(self, other: Surface) -> Surface:
        """Both together."""
        return Surface(
            self.lateral * other.lateral,
            self.spinning * other.lateral + other.spinning * self.lateral,
            self.compliance + other.compliance,
        )


def surfaces(constants: EpisodeConstants) -> dict[str, Surface]:
    """The surfaces of an episode: `tip`, `link` (all other links), `cube` and `table`."""
    return {
        "tip": Surface(constants.tip_friction, constants.tip_spinning_friction, constants.tip_compliance),
        "link": Surface(constants.link_friction),
        "cube": Surface(constants.cube_friction),
        "table": Surface(constants.table_friction),
    }
