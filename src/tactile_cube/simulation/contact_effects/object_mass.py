"""The object weighs more or less than is stated."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class ObjectMass(ContactEffect):
    """Mass beyond the stated one."""

    name = "object_mass"
    constant = "cube_mass"
    added = True
    parameters = (
        Parameter("excess", "kg", neutral=0.0, low=-0.1, high=0.2, typical=0.05, source="a guess: fillings, cables"),
    )
