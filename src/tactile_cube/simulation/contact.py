"""Contacts of the last physics step, named by what touches what."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_cube.simulation.constants import Array, EpisodeConstants


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


def named_contact(
    first: tuple[str, str],
    second: tuple[str, str],
    middle: Array,
    normal: Array,
    distance: float,
    force: float,
    friction: Array,
) -> Contact:
    """A contact told from the side of the finger; of the table where no finger takes part.

    Args:
        first: Name of the first body (of a finger, `cube` or `table`) and of its link, "" where there is none.
        second: Likewise.
        middle: Point between the two surfaces, in the world (3,) [m].
        normal: Unit vector from the first into the second (3,).
        distance: Gap [m].
        force: Normal force [N].
        friction: Friction force on the second (3,) [N].
    """
    if first[0] == "cube" or (first[0] == "table" and second[0] != "cube"):
        first, second, normal, friction = second, first, -normal, -friction
    return Contact(*first, second[0], middle + 0.5 * distance * normal, normal, distance, force, friction)


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
