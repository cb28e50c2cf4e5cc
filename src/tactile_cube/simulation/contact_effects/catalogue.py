"""Which contact effects exist, by name."""

from __future__ import annotations

from tactile_cube.drivetrain.effects import Effect, find_effect
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect
from tactile_cube.simulation.contact_effects.lateral_friction import LateralFriction
from tactile_cube.simulation.contact_effects.object_com import ObjectCom
from tactile_cube.simulation.contact_effects.object_mass import ObjectMass
from tactile_cube.simulation.contact_effects.object_size import ObjectSize
from tactile_cube.simulation.contact_effects.spinning_friction import SpinningFriction
from tactile_cube.simulation.contact_effects.tip_compliance import TipCompliance

_EFFECTS: tuple[type[ContactEffect], ...] = (
    LateralFriction,
    SpinningFriction,
    TipCompliance,
    ObjectMass,
    ObjectCom,
    ObjectSize,
)


def contact_catalogue() -> dict[str, type[ContactEffect]]:
    """Return all contact effects by name; they need a recording with an object."""
    return {effect.name: effect for effect in _EFFECTS}


def find_any_effect(name: str) -> type[ContactEffect] | type[Effect]:
    """Return an effect of the contact or of the drivetrain.

    Raises:
        InputError: there is no such effect.
    """
    return contact_catalogue().get(name) or find_effect(name)


def is_contact_effect(name: str) -> bool:
    """Return whether `NAME` or `NAME@...` names a contact effect."""
    return name.partition("@")[0] in contact_catalogue()
