"""Is the residual noise, or does it still know something? Whiteness and cross-correlation tests."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal, stats

from tactile_cube.measurement.recordings.trial import Array, Trial

LAGS = 20
LONGEST_DELAY = 0.1  # [s] between a cause and its trace in the residual


@dataclass(frozen=True)
class Whiteness:
    """Ljung-Box test of one joint's residual."""

    joint: str
    p_value: float  # of such autocorrelation in white noise; the smallest over the trials, times their number
    correlation_time: float  # how long the residual remembers itself [s]


@dataclass(frozen=True)
class CrossCorrelation:
    """How much of a residual goes with one signal."""

    joint: str  # whose residual
    cause: str  # the signal, in words
    correlation: float  # strongest within 0.1 s, averaged over the trials
    delay: float  # how much later the residual shows it [s]
    p_value: float  # of such a correlation between unrelated signals that remember themselves as these do


def whiteness(trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]) -> list[Whiteness]:
    """The test of each joint's residual over `LAGS` lags."""
    results = []
    for index, joint in enumerate(joints):
        columns = [_filled(error[:, index]) for error in errors]
        p = min(1.0, len(columns) * min(ljung_box(column) for column in columns))
        memory = [_memory(column) * trial.step for column, trial in zip(columns, trials, strict=True)]
        results.append(Whiteness(joint, p, float(np.mean(memory))))
    return results


def ljung_box(values: Array) -> float:
    """p-value of the Ljung-Box test: small means that `values` are no white noise."""
    n, lags = len(values), min(LAGS, len(values) // 5)
    correlation = _autocorrelation(values)[1 : lags + 1]
    statistic = n * (n + 2) * np.sum(correlation**2 / (n - np.arange(1, lags + 1)))
    return float(stats.chi2.sf(statistic, lags))


def cross_correlations(
    trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]
) -> list[CrossCorrelation]:
    """Every joint's residual against velocity, acceleration, torque, ... of all joints, the strongest first."""
    results = []
    for index, joint in enumerate(joints):
        causes: dict[str, list[tuple[float, float, float]]] = {}
        for trial, error in zip(trials, errors, strict=True):
            for name, cause in _causes(trial, joints).items():
                causes.setdefault(name, []).append(_strongest(_filled(error[:, index]), cause, trial.step))
        results += [_combined(joint, name, values) for name, values in causes.items()]
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


def _strongest(error: Array, cause: Array, step: float) -> tuple[float, float, float]:
    """Correlation, delay [s] and p-value at the lag where the residual follows the cause best."""
    a, b = error - error.mean(), cause - cause.mean()
    scale = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    if scale == 0:
        return 0.0, 0.0, 1.0
    longest = min(round(LONGEST_DELAY / step), len(a) // 4)
    full = signal.correlate(a, b, mode="full", method="fft") / scale
    window = full[len(b) - 1 : len(b) + longest]
    lag = int(np.argmax(np.abs(window)))
    effective = max(4.0, len(a) / _shared_memory(a, b))
    p = 2 * stats.norm.sf(abs(window[lag]) * np.sqrt(effective)) * max(1.0, longest / _memory(error))
    return float(window[lag]), lag * step, float(min(1.0, p))


def _combined(joint: str, cause: str, values: list[tuple[float, float, float]]) -> CrossCorrelation:
    correlation, delay, p = np.array(values).T
    combined = stats.combine_pvalues(np.clip(p, 1e-300, 1), method="fisher").pvalue
    return CrossCorrelation(joint, cause, float(correlation.mean()), float(np.median(delay)), float(combined))


def _shared_memory(a: Array, b: Array) -> float:
    """Bartlett's factor by which two signals with memory carry fewer independent samples."""
    lags = len(a) // 4
    return max(1.0, float(1 + 2 * np.sum(_autocorrelation(a)[1:lags] * _autocorrelation(b)[1:lags])))


def _memory(values: Array) -> float:
    """Samples until the autocorrelation has fallen below 1/e."""
    below = np.flatnonzero(_autocorrelation(values) < np.exp(-1))
    return float(below[0]) if len(below) else float(len(values))


def _autocorrelation(values: Array) -> Array:
    centred = values - values.mean()
    full = signal.correlate(centred, centred, mode="full", method="fft")[len(values) - 1 :]
    return np.asarray(full / full[0] if full[0] > 0 else np.eye(1, len(values))[0])


def _filled(values: Array) -> Array:
    good = np.isfinite(values)
    if good.all():
        return values
    return np.asarray(np.interp(np.arange(len(values)), np.flatnonzero(good), values[good]))
