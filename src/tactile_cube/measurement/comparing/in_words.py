"""The table of regimes in sentences: "q3 lags just after reversals, 9 mrad, at low speed"."""

from collections.abc import Mapping, Sequence

from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.comparing.regimes import Regime
from tactile_cube.measurement.units import milli, short

WORTH_SAYING = 1.5  # error / noise floor of a joint below which nothing is said
STANDS_OUT = 1.25  # error of a regime / error of the joint
ONE_SIDED = 0.5  # |mean| / RMS above which an error has a direction
RARE = 0.01  # share of the samples below which a regime is no place to point at
PLACES = ("reversal", "speed", "load", "posture", "time", "direction")
COMPANY = ("kind", "neighbours")


def where_it_fails(
    table: Sequence[Regime], errors: Mapping[str, float], floor: NoiseFloor, units: Mapping[str, str]
) -> list[str]:
    """One sentence for each joint, the worst joint first."""
    worst_first = sorted(errors, key=lambda joint: -errors[joint] / floor.joints[joint])
    return [
        _sentence(joint, [r for r in table if r.joint == joint], errors[joint], floor, units[joint])
        for joint in worst_first
    ]


def _sentence(joint: str, rows: list[Regime], error: float, floor: NoiseFloor, unit: str) -> str:
    ratio = error / floor.joints[joint]
    size = f"({short(ratio, 2)} times the noise floor)"
    if ratio < WORTH_SAYING:
        return f"{joint} follows the model: {milli(error, unit, 2)} {size}"
    standing_out = [row for row in rows if row.error > STANDS_OUT * error and row.share > RARE]
    places = _worst_of_each(standing_out, PLACES)[:2] or _worst_of_each(standing_out, COMPANY)[:1]
    if not places:
        return f"{joint} {_verb(rows, error)} everywhere, {milli(error, unit, 2)} {size}"
    first, more = places[0], "".join(f", {_place(row)}" for row in places[1:])
    kind = next((row for row in _worst_of_each(standing_out, ("kind",)) if row is not first), None)
    mostly = f", most of all in {kind.regime}" if kind is not None else ""
    return f"{joint} {_verb([first], error)} {_place(first)}, {milli(first.error, unit, 2)}{more}{mostly} {size}"


def _worst_of_each(rows: list[Regime], dimensions: Sequence[str]) -> list[Regime]:
    """The worst regime of each dimension, the worst first."""
    chosen: dict[str, Regime] = {}
    for row in sorted(rows, key=lambda row: -row.error):
        if row.dimension in dimensions:
            chosen.setdefault(row.dimension, row)
    return list(chosen.values())


def _verb(rows: list[Regime], error: float) -> str:
    samples = sum(row.samples for row in rows)
    lag = sum(row.lag * row.samples for row in rows) / samples
    bias = sum(row.bias * row.samples for row in rows) / samples
    rms = max(row.error for row in rows) if len(rows) == 1 else error
    if abs(lag) > ONE_SIDED * rms:
        return "lags" if lag < 0 else "runs ahead"
    if abs(bias) > ONE_SIDED * rms:
        return "sits too high" if bias > 0 else "sits too low"
    return "is off"


def _place(row: Regime) -> str:
    if row.dimension in ("speed", "load"):
        return f"at {row.regime}"
    if row.dimension in ("posture", "time"):
        return f"in the {row.regime}"
    if row.dimension == "kind":
        return f"in {row.regime}"
    if row.dimension == "neighbours":
        return f"with {row.regime}"
    return row.regime
