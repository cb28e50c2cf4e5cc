"""What surfaces are like, in physical terms, and what two of them are together; each engine has its translation.

Lateral friction of a pair is the product of both factors. Torque against spinning is a length times the normal force:
each body's own, at the other one's lateral factor.
"""

from __future__ import annotations

from dataclasses import dataclass

from tactile_cube.simulation.constants import EpisodeConstants

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
