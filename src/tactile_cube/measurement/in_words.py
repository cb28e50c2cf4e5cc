"""The table of regimes in sentences: "q3 lags just after reversals, 9 mrad, at low speed"."""

from collections.abc import Sequence

from tactile_cube.measurement.noise_floor import NoiseFloor
from tactile_cube.measurement.regimes import Regime

WORTH_SAYING = 1.5  # error / noise floor of a joint below which nothing is said
STANDS_OUT = 1.25  # error of a regime / error of the joint
ONE_SIDED = 0.5  # |mean| / RMS above which an error has a direction
PLACES = ("reversal", "speed", "load", "posture", "time", "neighbours", "direction", "kind")


def where_it_fails(table: Sequence[Regime], errors: dict[str, float], floor: NoiseFloor) -> list[str]:
    """One sentence for each joint, the worst joint first."""
    worst_first = sorted(errors, key=lambda joint: -errors[joint] / floor.joints[joint])
    return [_sentence(joint, [r for r in table if r.joint == joint], errors[joint], floor) for joint in worst_first]


def _sentence(joint: str, rows: list[Regime], error: float, floor: NoiseFloor) -> str:
    ratio = error / floor.joints[joint]
    if ratio < WORTH_SAYING:
        return f"{joint} follows the model: {1e3 * error:.2g} mrad, {ratio:.2g} times the noise floor"
    outstanding = sorted((r for r in rows if r.error > STANDS_OUT * error), key=lambda r: -r.error)
    places: list[Regime] = []
    for row in outstanding:
        if row.dimension not in {place.dimension for place in places} and row.dimension != "kind":
            places.append(row)
    kinds = [row for row in outstanding if row.dimension == "kind"]
    if not places and not kinds:
        return f"{joint} {_verb(rows, error)} everywhere, {1e3 * error:.2g} mrad ({ratio:.2g} times the noise floor)"
    first, second = ((places + kinds) + [None])[:2] if places else (kinds[0], None)
    where = _place(first)
    also = (
        f", most in {_place(second)}"
        if second is not None and second.dimension == "kind"
        else (f", {_place(second)}" if second is not None else "")
    )
    return f"{joint} {_verb([first], error)} {where}, {1e3 * first.error:.2g} mrad{also} ({ratio:.2g} times the noise floor)"


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
    if row.dimension in ("posture", "time", "kind"):
        return f"in the {row.regime}"
    if row.dimension == "neighbours":
        return f"with {row.regime}"
    return row.regime
