"""Where the error is, by speed, reversal, direction, load, posture, time and kind of trial; is the residual white?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats

from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.units import milli, short

Mask = NDArray[np.bool_]
SPEEDS = {"standstill": 0.02, "low speed": 0.3, "medium speed": 1.5, "high speed": np.inf}  # [rad/s] upper ends
MOVING = 0.02  # [rad/s]
REVERSAL = 0.2  # [s] "just after"
FEWEST = 25  # samples below which a regime says nothing


@dataclass(frozen=True)
class Regime:
    """The error of one joint in one regime."""

    joint: str
    dimension: str  # speed, reversal, direction, load, posture, time, neighbours or kind
    regime: str  # which part of the dimension, in words
    error: float  # RMS [rad]
    bias: float  # mean of measured - simulated [rad]
    lag: float  # mean of measured - simulated in the direction of the latest motion [rad]; negative: the rig lags
    share: float  # part of the joint's samples
    samples: int


def regimes(trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]) -> list[Regime]:
    """Build the table of regimes, joint by joint, from the residuals (n, joints) of each trial."""
    table: list[Regime] = []
    velocities = [trial.velocity() for trial in trials]
    for index, joint in enumerate(joints):
        error = np.concatenate([one[:, index] for one in errors])
        direction = np.concatenate([latest_direction(one[:, index]) for one in velocities])
        for dimension, parts in _parts(trials, velocities, index).items():
            for name, part in parts.items():
                mask = part & np.isfinite(error)
                if mask.sum() >= FEWEST:
                    here = error[mask]
                    rms, lag = float(np.sqrt(np.mean(here**2))), float(np.mean(here * direction[mask]))
                    row = (rms, float(here.mean()), lag, float(mask.mean()), int(mask.sum()))
                    table.append(Regime(joint, dimension, name, *row))
    return table


def latest_direction(velocity: Array) -> Array:
    """Return +1 or -1 by the sign of the latest motion, 0 before the first one."""
    sign = np.where(np.abs(velocity) > MOVING, np.sign(velocity), 0.0)
    latest = np.maximum.accumulate(np.where(sign != 0, np.arange(len(sign)), 0))
    return np.asarray(sign[latest])


def after_reversal(velocity: Array, step: float) -> Mask:
    """Return the samples within 0.2 s after the velocity changed its sign; a standstill in between is no change."""
    sign = np.where(np.abs(velocity) > MOVING, np.sign(velocity), 0.0)
    moving = np.flatnonzero(sign)
    turns = moving[1:][sign[moving[1:]] != sign[moving[:-1]]]
    mask = np.zeros(len(velocity), dtype=bool)
    for turn in turns:
        mask[turn : turn + round(REVERSAL / step)] = True
    return mask


def _parts(trials: Sequence[Trial], velocities: Sequence[Array], joint: int) -> dict[str, dict[str, Mask]]:
    """Return dimension -> regime -> the samples (of all trials end to end) of a joint that are in it."""
    velocity = np.concatenate([one[:, joint] for one in velocities])
    speed, edges = np.abs(velocity), [0.0, *SPEEDS.values()]
    turned = np.concatenate(
        [after_reversal(one[:, joint], trial.step) for trial, one in zip(trials, velocities, strict=True)]
    )
    kinds = np.concatenate([np.full(len(trial.time), trial.kind) for trial in trials])
    position = np.concatenate([trial.position[:, joint] for trial in trials])
    phase = np.concatenate([trial.time / trial.duration for trial in trials])
    others = [np.abs(np.delete(one, joint, axis=1)).max(axis=1, initial=0.0) for one in velocities]
    fast = np.concatenate(others) > SPEEDS["low speed"]
    return {
        "speed": {
            name: (speed >= least) & (speed < most) for (name, most), least in zip(SPEEDS.items(), edges, strict=False)
        },
        "reversal": {"just after reversals": turned, "away from reversals": ~turned},
        "direction": {"moving up": velocity > MOVING, "moving down": velocity < -MOVING},
        "load": _load(trials, joint),
        "posture": _thirds(position, "third of the range", ("low", "middle", "high")),
        "time": _thirds(phase, "third of the trial", ("first", "second", "last")),
        "neighbours": {"other joints moving": fast, "other joints slow or still": ~fast} if fast.any() else {},
        "kind": {f"{kind} trials": kinds == kind for kind in dict.fromkeys(kinds.tolist())},
    }


def _load(trials: Sequence[Trial], joint: int) -> dict[str, Mask]:
    """Split the samples by the size of the measured torque; return no regimes without a measured torque."""
    parts = [np.full(len(t.time), np.nan) if t.torque is None else t.torque[:, joint] for t in trials]
    torque = np.abs(np.concatenate(parts))
    if np.isnan(torque).all():
        return {}
    half = 0.5 * float(np.nanpercentile(torque, 98))
    return {"low load": torque < half, "high load": torque >= half}


def _thirds(values: Array, of: str, names: tuple[str, str, str]) -> dict[str, Mask]:
    low, high = values.min() + np.ptp(values) * np.array([1, 2]) / 3
    part = (values >= low).astype(int) + (values >= high)
    return {f"{name} {of}": part == index for index, name in enumerate(names)}


WORTH_SAYING = 1.5  # error / noise floor of a joint below which nothing is said
STANDS_OUT = 1.25  # error of a regime / error of the joint
ONE_SIDED = 0.5  # |mean| / RMS above which an error has a direction
RARE = 0.01  # share of the samples below which a regime is no place to point at
PLACES = ("reversal", "speed", "load", "posture", "time", "direction")
COMPANY = ("kind", "neighbours")
PREPOSITIONS = {"speed": "at", "load": "at", "posture": "in the", "time": "in the", "kind": "in", "neighbours": "with"}


def where_it_fails(
    table: Sequence[Regime], errors: Mapping[str, float], floor: NoiseFloor, units: Mapping[str, str]
) -> list[str]:
    """Describe each joint's error in one sentence; the joint with the largest error over noise floor comes first."""
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
    return f"{joint} {_verb([first], first.error)} {_place(first)}, {milli(first.error, unit, 2)}{more}{mostly} {size}"


def _worst_of_each(rows: list[Regime], dimensions: Sequence[str]) -> list[Regime]:
    chosen: dict[str, Regime] = {}
    for row in sorted(rows, key=lambda row: -row.error):
        if row.dimension in dimensions:
            chosen.setdefault(row.dimension, row)
    return list(chosen.values())


def _verb(rows: list[Regime], rms: float) -> str:
    samples = sum(row.samples for row in rows)
    lag = sum(row.lag * row.samples for row in rows) / samples
    bias = sum(row.bias * row.samples for row in rows) / samples
    if abs(lag) > ONE_SIDED * rms:
        return "lags" if lag < 0 else "runs ahead"
    if abs(bias) > ONE_SIDED * rms:
        return "sits too high" if bias > 0 else "sits too low"
    return "is off"


def _place(row: Regime) -> str:
    return f"{PREPOSITIONS.get(row.dimension, '')} {row.regime}".strip()


LAGS = 20
LONGEST_DELAY = 0.1  # [s] between a cause and its trace in the residual


@dataclass(frozen=True)
class Whiteness:
    """Ljung-Box test of one joint's residual."""

    joint: str
    p_value: float  # of that autocorrelation in white noise; the smallest over the trials, times their number
    correlation_time: float  # autocorrelation time of the residual [s]


@dataclass(frozen=True)
class CrossCorrelation:
    """Correlation of a residual with one signal."""

    joint: str  # whose residual
    cause: str  # the signal, in words
    correlation: float  # strongest within 0.1 s, averaged over the trials
    delay: float  # how much later the residual shows it [s]
    p_value: float  # of that correlation between unrelated signals with the same autocorrelation


def whiteness(trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]) -> list[Whiteness]:
    """Test the whiteness of each joint's residual over `LAGS` lags."""
    results = []
    for index, joint in enumerate(joints):
        columns = [_filled(error[:, index]) for error in errors]
        p = min(1.0, len(columns) * min(ljung_box(column) for column in columns))
        memory = [_memory(_autocorrelation(column)) * trial.step for column, trial in zip(columns, trials, strict=True)]
        results.append(Whiteness(joint, p, float(np.mean(memory))))
    return results


def ljung_box(values: Array) -> float:
    """Return the p-value of the Ljung-Box test: small means that `values` are no white noise."""
    n, lags = len(values), min(LAGS, len(values) // 5)
    correlation = _autocorrelation(values)[1 : lags + 1]
    statistic = n * (n + 2) * np.sum(correlation**2 / (n - np.arange(1, lags + 1)))
    return float(stats.chi2.sf(statistic, lags))


def cross_correlations(
    trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]
) -> list[CrossCorrelation]:
    """Correlate every joint's residual with velocity, acceleration, torque, ... of all joints, the strongest first."""
    found: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for trial, error in zip(trials, errors, strict=True):
        causes = {name: (cause, _autocorrelation(cause)) for name, cause in _causes(trial, joints).items()}
        for index, joint in enumerate(joints):
            own = _filled(error[:, index])
            remembered = _autocorrelation(own)
            for name, cause in causes.items():
                strongest = _strongest((own, remembered), cause, trial.step)
                found.setdefault((joint, name), []).append(strongest)
    results = []
    for (joint, name), values in found.items():
        correlation, delay, p = np.array(values).T
        combined = float(stats.combine_pvalues(np.clip(p, 1e-300, 1), method="fisher").pvalue)
        results.append(CrossCorrelation(joint, name, float(correlation.mean()), float(np.median(delay)), combined))
    return sorted(results, key=lambda one: -abs(one.correlation))


def _causes(trial: Trial, joints: Sequence[str]) -> dict[str, Array]:
    velocity = trial.velocity()
    acceleration = np.gradient(velocity, trial.step, axis=0)
    direction = np.sign(np.where(np.abs(velocity) > 0.02, velocity, 0.0))
    signals = {"position": trial.position, "velocity": velocity, "acceleration": acceleration}
    signals["direction of motion"] = direction
    if trial.torque is not None:
        signals["torque"] = trial.torque
    return {f"{name} of {joint}": values[:, j] for name, values in signals.items() for j, joint in enumerate(joints)}


def _strongest(error: tuple[Array, Array], cause: tuple[Array, Array], step: float) -> tuple[float, float, float]:
    """Return the correlation, delay [s] and p-value at the lag where the residual follows the cause best.

    Either signal comes with its autocorrelation.
    """
    a, b = (values - values.mean() for values, _ in (error, cause))
    scale = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    if scale == 0:
        return 0.0, 0.0, 1.0
    longest = min(round(LONGEST_DELAY / step), len(a) // 4)
    full = signal.correlate(a, b, mode="full", method="fft") / scale
    window = full[len(b) - 1 : len(b) + longest]
    lag = int(np.argmax(np.abs(window)))
    lags = slice(1, len(a) // 4)
    shared = float(1 + 2 * np.sum(error[1][lags] * cause[1][lags]))
    effective = max(4.0, len(a) / max(1.0, shared))  # fewer independent samples, by Bartlett's factor
    p = 2 * stats.norm.sf(abs(window[lag]) * np.sqrt(effective)) * max(1.0, longest / _memory(error[1]))
    return float(window[lag]), lag * step, float(min(1.0, p))


def _memory(autocorrelation: Array) -> float:
    """Return the samples until an autocorrelation has fallen below 1/e."""
    below = np.flatnonzero(autocorrelation < np.exp(-1))
    return float(below[0]) if len(below) else float(len(autocorrelation))


def _autocorrelation(values: Array) -> Array:
    centred = values - values.mean()
    full = signal.correlate(centred, centred, mode="full", method="fft")[len(values) - 1 :]
    return np.asarray(full / full[0] if full[0] > 0 else np.eye(1, len(values))[0])


def _filled(values: Array) -> Array:
    good = np.isfinite(values)
    if good.all():
        return values
    return np.asarray(np.interp(np.arange(len(values)), np.flatnonzero(good), values[good]))
