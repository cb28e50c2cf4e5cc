"""The object is larger or smaller than is stated."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class ObjectSize(ContactEffect):
    """Length added to each edge of the object.

    size = stated size + excess.

    In data: the fingers close earlier or later, alike in all initialisations.
    Confused with: joint offsets, in a single initialisation.
    """

    name = "object_size"
    constant = "cube_size"
    added = True
    shows_in = "offsets"
    parameters = (
        Parameter(
            "excess", "m", neutral=0.0, low=-0.01, high=0.01, typical=0.003, source="website: cubes differ by 5 mm"
        ),
    )
