"""The object weighs more or less than is stated."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.constants import EpisodeConstants
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect

LEAST = 0.1
"""Smallest share of the stated mass: a search may try values that would leave less than nothing."""


class ObjectMass(ContactEffect):
    """Mass of the object beyond the stated one.

    m = stated mass + excess; at least a tenth of the stated mass remains.

    In data: joints give way with the weight; the object slips earlier.
    Confused with: `lateral_friction` where the object slips; `torque_gain` of the joints.
    """

    name = "object_mass"
    constant = "cube_mass"
    added = True
    parameters = (
        Parameter("excess", "kg", neutral=0.0, low=-0.1, high=0.2, typical=0.05, source="a guess: fillings, cables"),
    )

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """Return the constants with this effect; at least a tenth of the stated mass remains."""
        least = (LEAST - 1.0) * constants.cube_mass
        return super().apply(constants, {key: max(value, least) for key, value in values.items()})
