"""Friction of a fingertip against spinning."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class SpinningFriction(ContactEffect):
    """Resistance of a fingertip against being turned on the spot.

    |torque about the contact normal| <= radius * normal force. The length is about the contact patch's radius times the
    friction coefficient.

    In data: the object turns about the line between two tips, earlier than in the model or later.
    Confused with: `object_com`, which changes the torque at which it turns.
    """

    name = "spinning_friction"
    constant = "tip_spinning_friction"
    shown_by = ("twist",)
    parameters = (
        Parameter(
            "radius", "m", neutral=0.003, low=2e-4, high=0.3, typical=0.02, source="website: 0.1, 0.03, 2e-4..2e-2"
        ),
    )
