"""The object's centre of mass lies elsewhere than is stated."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect

_SOURCE = "a guess: a cube of 8 cm that is filled unevenly"


class ObjectCom(ContactEffect):
    """Displacement of the object's centre of mass, in the object's frame.

    c = stated centre + (x, y, z).

    In data: the fingers on one side carry more than those on the other.
    Confused with: joint offsets of a single initialisation.
    """

    name = "object_com"
    constant = "cube_com"
    added = True
    shows_in = "load"
    parameters = (
        Parameter("x", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_SOURCE),
        Parameter("y", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_SOURCE),
        Parameter("z", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_SOURCE),
    )
