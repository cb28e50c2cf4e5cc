"""In which units people read a joint's numbers: mrad and N m where it turns, mm and N where it slides."""

import re
from collections.abc import Iterable

TURNS, SLIDES = "rad", "m"
EITHER = "rad or m"
MILLION = 1e6  # beyond it numbers are written as powers of ten
THOUSANDTHS = {TURNS: "mrad", SLIDES: "mm", EITHER: "mrad or mm"}
SLIDING = (("N m", "N"), ("kg m^2", "kg"), ("rad", "m"))


def common_unit(units: Iterable[str]) -> str:
    """The unit of a number over several joints: rad, m, or `rad or m` where some turn and others slide."""
    found = set(units) or {TURNS}
    return found.pop() if len(found) == 1 else EITHER


def milli(value: float, unit: str = TURNS, digits: int = 3) -> str:
    """A position [rad or m] in thousandths, three digits: 0.0471 mrad, 12.3 mm."""
    return f"{short(1e3 * value, digits)} {THOUSANDTHS[unit]}"


def short(value: float, digits: int = 3) -> str:
    """Significant digits, no powers of ten below a million: 0.0471, 12.3, 382."""
    whole = 10**digits * 0.9995 / 10 <= abs(value) < MILLION
    return f"{value:.0f}" if whole else f"{value:.{digits}g}"


def of_joint(text: str, unit: str) -> str:
    """A unit, or a label with a unit in it, as a joint of `unit` has it: `N m s/rad` is `N s/m` where it slides."""
    if unit != SLIDES:
        return text
    for turning, sliding in SLIDING:
        text = re.sub(rf"(?<![A-Za-z]){re.escape(turning)}(?![A-Za-z])", sliding, text)
    return text
