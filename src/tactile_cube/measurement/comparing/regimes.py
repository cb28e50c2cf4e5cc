"""Where the error is: by joint and speed, after a reversal, direction, load, posture, time and kind of trial."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.units import milli, short

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SPEEDS = {"standstill": 0.02, "low speed": 0.3, "medium speed": 1.5, "high speed": np.inf}  # [rad/s] upper ends
MOVING = 0.02  # [rad/s]
REVERSAL = 0.2  # [s] "just after"
FEWEST = 25  # samples below which a regime says nothing


@dataclass(frozen=True)
class Regime:
    """The error of one joint in one regime.

    Attributes:
        joint: its name.
        dimension: speed, reversal, direction, load, posture, time, neighbours or kind.
        regime: which part of the dimension, in words.
        error: RMS [rad].
        bias: mean of measured - simulated [rad].
        lag: mean of measured - simulated in the direction of the latest motion [rad]; negative: the rig stays behind.
        share: part of the joint's samples.
        samples: how many.
    """

    joint: str
    dimension: str
    regime: str
    error: float
    bias: float
    lag: float
    share: float
    samples: int


@dataclass(frozen=True)
class Samples:
    """All samples of one joint, trials end to end, each (samples,)."""

    error: Array
    position: Array
    velocity: Array
    direction: Array
    torque: Array
    neighbours: Array
    reversed: Mask
    phase: Array
    kind: NDArray[np.str_]


def joint_samples(trials: Sequence[Trial], errors: Sequence[Array], joint: int) -> Samples:
    """The samples of joint number `joint`: residual [rad], position, velocity, torque (nan if not measured), ..."""
    velocities = [trial.velocity() for trial in trials]
    others = [np.abs(np.delete(v, joint, axis=1)).max(axis=1, initial=0.0) for v in velocities]
    return Samples(
        error=np.concatenate([error[:, joint] for error in errors]),
        position=np.concatenate([trial.position[:, joint] for trial in trials]),
        velocity=np.concatenate([v[:, joint] for v in velocities]),
        direction=np.concatenate([latest_direction(v[:, joint]) for v in velocities]),
        torque=np.concatenate([_torque(trial)[:, joint] for trial in trials]),
        neighbours=np.concatenate(others),
        reversed=np.concatenate([after_reversal(v[:, joint], t.step) for t, v in zip(trials, velocities, strict=True)]),
        phase=np.concatenate([trial.time / trial.duration for trial in trials]),
        kind=np.concatenate([np.full(len(trial.time), trial.kind) for trial in trials]),
    )


def regimes(trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]) -> list[Regime]:
    """The table of regimes, joint by joint, from residuals (n, joints) of each trial."""
    table: list[Regime] = []
    for index, joint in enumerate(joints):
        samples = joint_samples(trials, errors, index)
        usable = np.isfinite(samples.error)
        for dimension, classify in DIMENSIONS.items():
            for name, mask in classify(samples).items():
                if (mask & usable).sum() >= FEWEST:
                    table.append(_row(joint, dimension, name, samples, mask & usable))
    return table


def _row(joint: str, dimension: str, name: str, samples: Samples, mask: Mask) -> Regime:
    error = samples.error[mask]
    lag = float(np.mean(error * samples.direction[mask]))
    rms, bias = float(np.sqrt(np.mean(error**2))), float(error.mean())
    return Regime(joint, dimension, name, rms, bias, lag, float(mask.mean()), int(mask.sum()))


def latest_direction(velocity: Array) -> Array:
    """+1 or -1 by the sign of the latest motion, 0 before the first one."""
    sign = np.where(np.abs(velocity) > MOVING, np.sign(velocity), 0.0)
    latest = np.maximum.accumulate(np.where(sign != 0, np.arange(len(sign)), 0))
    return np.asarray(sign[latest])


def after_reversal(velocity: Array, step: float) -> Mask:
    """Samples within 0.2 s after the velocity took the other sign; a standstill in between does not count as one."""
    sign = np.where(np.abs(velocity) > MOVING, np.sign(velocity), 0.0)
    moving = np.flatnonzero(sign)
    turns = moving[1:][sign[moving[1:]] != sign[moving[:-1]]]
    mask = np.zeros(len(velocity), dtype=bool)
    for turn in turns:
        mask[turn : turn + round(REVERSAL / step)] = True
    return mask


def _torque(trial: Trial) -> Array:
    return np.full_like(trial.position, np.nan) if trial.torque is None else trial.torque


def _speed(samples: Samples) -> dict[str, Mask]:
    parts, least = {}, 0.0
    for name, most in SPEEDS.items():
        parts[name] = (np.abs(samples.velocity) >= least) & (np.abs(samples.velocity) < most)
        least = most
    return parts


def _reversal(samples: Samples) -> dict[str, Mask]:
    return {"just after reversals": samples.reversed, "away from reversals": ~samples.reversed}


def _direction(samples: Samples) -> dict[str, Mask]:
    return {"moving up": samples.velocity > MOVING, "moving down": samples.velocity < -MOVING}


def _load(samples: Samples) -> dict[str, Mask]:
    if np.isnan(samples.torque).all():
        return {}
    half = 0.5 * float(np.nanpercentile(np.abs(samples.torque), 98))
    return {"low load": np.abs(samples.torque) < half, "high load": np.abs(samples.torque) >= half}


def _posture(samples: Samples) -> dict[str, Mask]:
    return _thirds(samples.position, "third of the range", ("low", "middle", "high"))


def _time(samples: Samples) -> dict[str, Mask]:
    return _thirds(samples.phase, "third of the trial", ("first", "second", "last"))


def _thirds(values: Array, of: str, names: tuple[str, str, str]) -> dict[str, Mask]:
    low, high = values.min() + np.ptp(values) * np.array([1, 2]) / 3
    part = (values >= low).astype(int) + (values >= high)
    return {f"{name} {of}": part == index for index, name in enumerate(names)}


def _neighbours(samples: Samples) -> dict[str, Mask]:
    fast = samples.neighbours > SPEEDS["low speed"]
    return {"other joints moving": fast, "other joints slow or still": ~fast} if fast.any() else {}


def _kind(samples: Samples) -> dict[str, Mask]:
    return {f"{kind} trials": samples.kind == kind for kind in dict.fromkeys(samples.kind.tolist())}


DIMENSIONS: dict[str, Callable[[Samples], dict[str, Mask]]] = {
    "speed": _speed,
    "reversal": _reversal,
    "direction": _direction,
    "load": _load,
    "posture": _posture,
    "time": _time,
    "neighbours": _neighbours,
    "kind": _kind,
}


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
