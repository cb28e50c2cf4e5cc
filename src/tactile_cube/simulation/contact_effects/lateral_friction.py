"""How much a fingertip holds sideways."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class LateralFriction(ContactEffect):
    """Coulomb friction between fingertip and object: sideways force over normal force."""

    name = "lateral_friction"
    constant = "tip_friction"
    parameters = (
        Parameter(
            "coefficient", "1", neutral=0.9, low=0.2, high=1.6, typical=0.6, source="website: 0.9; rubber 0.5-1.2"
        ),
    )
