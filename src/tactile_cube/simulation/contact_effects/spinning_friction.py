"""How much a fingertip resists being turned on the spot."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class SpinningFriction(ContactEffect):
    """Torque about the contact normal over normal force, a length: about the contact patch's radius times friction."""

    name = "spinning_friction"
    constant = "tip_spinning_friction"
    shown_by = ("twist",)
    parameters = (
        Parameter(
            "radius", "m", neutral=0.003, low=2e-4, high=0.3, typical=0.02, source="website: 0.1, 0.03, 2e-4..2e-2"
        ),
    )
