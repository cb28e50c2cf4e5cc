"""The catalogue of contact effects: properties of fingertips and object, one class each."""

from tactile_cube.simulation.contact_effects.catalogue import contact_catalogue, find_any_effect, is_contact_effect
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect
from tactile_cube.simulation.contact_effects.lateral_friction import LateralFriction
from tactile_cube.simulation.contact_effects.object_com import ObjectCom
from tactile_cube.simulation.contact_effects.object_mass import ObjectMass
from tactile_cube.simulation.contact_effects.object_size import ObjectSize
from tactile_cube.simulation.contact_effects.spinning_friction import SpinningFriction
from tactile_cube.simulation.contact_effects.tip_compliance import TipCompliance

__all__ = [
    "ContactEffect",
    "LateralFriction",
    "ObjectCom",
    "ObjectMass",
    "ObjectSize",
    "SpinningFriction",
    "TipCompliance",
    "contact_catalogue",
    "find_any_effect",
    "is_contact_effect",
]
