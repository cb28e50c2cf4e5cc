"""The object is larger or smaller than is stated."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class ObjectSize(ContactEffect):
    """Length added to each edge. In one initialisation joint offsets look the same; in all of them they would not."""

    name = "object_size"
    constant = "cube_size"
    added = True
    shows_in = "offsets"
    parameters = (
        Parameter(
            "excess", "m", neutral=0.0, low=-0.01, high=0.01, typical=0.003, source="website: cubes differ by 5 mm"
        ),
    )
