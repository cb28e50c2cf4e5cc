"""Friction of a fingertip against sliding."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class LateralFriction(ContactEffect):
    """Coulomb friction between fingertip and object.

    |sideways force| <= coefficient * normal force.

    In data: the object slips in the hand, earlier than in the model or later.
    Confused with: `object_mass` where the load that makes it slip is its weight.
    """

    name = "lateral_friction"
    constant = "tip_friction"
    parameters = (
        Parameter(
            "coefficient", "1", neutral=0.9, low=0.2, high=1.6, typical=0.6, source="website: 0.9; rubber 0.5-1.2"
        ),
    )
