"""The object weighs more or less than is stated."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.constants import EpisodeConstants
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect

LEAST = 0.1
"""Share of the stated mass that always remains: a search must not try a weight below nothing."""


class ObjectMass(ContactEffect):
    """Mass beyond the stated one."""

    name = "object_mass"
    constant = "cube_mass"
    added = True
    parameters = (
        Parameter("excess", "kg", neutral=0.0, low=-0.1, high=0.2, typical=0.05, source="a guess: fillings, cables"),
    )

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """As of every effect; a tenth of the stated mass always remains."""
        least = (LEAST - 1.0) * constants.cube_mass
        return super().apply(constants, {key: max(value, least) for key, value in values.items()})
