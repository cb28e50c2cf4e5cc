"""Display units of a joint: mrad or deg and N m where it turns, mm and N where it slides."""

import math
import re
from collections.abc import Iterable, Mapping

TURNS, SLIDES, DEGREES = "rad", "m", "deg"
EITHER = "rad or m"
MILLION = 1e6  # beyond it numbers are written as powers of ten
SMALL = {TURNS: ("mrad", 1e3), SLIDES: ("mm", 1e3), EITHER: ("mrad or mm", 1e3), DEGREES: ("deg", math.degrees(1.0))}
"""Unit of a position -> unit of its errors, and how many of them make a rad or m."""
SLIDING = (("N m", "N"), ("kg m^2", "kg"), ("rad", "m"))


def common_unit(units: Iterable[str]) -> str:
    """Return the unit of a value over several joints: deg or m if all have it, else rad; `rad or m` if some slide."""
    found = set(units) or {TURNS}
    return found.pop() if len(found) == 1 else EITHER if SLIDES in found or EITHER in found else TURNS


def milli(value: float, unit: str = TURNS, digits: int = 3) -> str:
    """Format a position [rad or m] in thousandths, or degrees, three digits: 0.0471 mrad, 12.3 mm, 0.624 deg."""
    name, size = SMALL[unit]
    return f"{short(size * value, digits)} {name}"


def short(value: float, digits: int = 3) -> str:
    """Return the significant digits, no powers of ten below a million: 0.0471, 12.3, 382."""
    whole = 10**digits * 0.9995 / 10 <= abs(value) < MILLION
    return f"{value:.0f}" if whole else f"{value:.{digits}g}"


def of_joint(text: str, unit: str) -> str:
    """Convert a unit, or a label with one, for a joint of `unit`: `N m s/rad` becomes `N s/m` if the joint slides."""
    if unit != SLIDES:
        return text
    for turning, sliding in SLIDING:
        text = re.sub(rf"(?<![A-Za-z]){re.escape(turning)}(?![A-Za-z])", sliding, text)
    return text


def shown(label: str, unit: str) -> tuple[str, float]:
    """Return a signal's label for a joint of `unit`, and the factor by which its SI values are multiplied.

    Example:
        >>> shown("velocity of elbow [rad/s]", "deg")
        ('velocity of elbow [deg/s]', 57.29577951308232)
    """
    if unit == DEGREES and "[rad" in label:
        return label.replace("[rad", "[deg"), math.degrees(1.0)
    return of_joint(label, unit), 1.0


def named(signal: str, units: Mapping[str, str]) -> tuple[str, float]:
    """Return `shown` of a signal that names its joint, such as `velocity of elbow [rad/s]`."""
    return shown(signal, next((unit for joint, unit in units.items() if f" of {joint} [" in signal), TURNS))
