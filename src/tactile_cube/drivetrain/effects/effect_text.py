"""An effect as a user writes it: `stribeck_friction@q3` or `stribeck_friction@q3: excess=0.08, velocity=0.3`."""

from collections.abc import Callable
from typing import Any

from tactile_cube.drivetrain.effects.catalogue import find_effect
from tactile_cube.errors import InputError


def parse_effect(text: str, find: Callable[[str], Any] = find_effect) -> tuple[str, dict[str, float]]:
    """Return `NAME@JOINT` and parameter -> value; parameters that are not given take their typical values.

    Args:
        text: as a user writes it.
        find: returns the effect of a name.

    Raises:
        InputError: an unknown effect or parameter, or a value that is no number.
    """
    name, _, assignments = text.partition(":")
    name = name.strip()
    parameters = {one.name: one.typical for one in find(name.partition("@")[0]).parameters}
    for assignment in filter(None, (part.strip() for part in assignments.split(","))):
        key, equals, value = (part.strip() for part in assignment.partition("="))
        if key not in parameters or not equals:
            raise InputError(f"effect: '{assignment}' in '{text}': {name} has the parameters {sorted(parameters)}")
        try:
            parameters[key] = float(value)
        except ValueError:
            raise InputError(f"effect: '{assignment}' in '{text}': '{value}' is no number") from None
    return name, parameters
