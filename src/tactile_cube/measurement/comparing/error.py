"""How far a simulation is from a measurement: RMS position error, the constant joint offsets removed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Simulated, Simulator


@dataclass(frozen=True)
class ErrorSummary:
    """RMS error [rad] pooled over samples: over all joints, and joint by joint."""

    overall: float
    joints: dict[str, float]


def residuals(trials: Sequence[Trial], simulated: Sequence[Array]) -> list[Array]:
    """Return measured - simulated (n, joints) [rad] of each trial, without the mean over its initialisation's trials.

    The mean is the joint offset. nan where a sample was bridged; `simulated` are positions (n, joints) [rad].
    """
    raw = raw_residuals(trials, simulated)
    offsets = {
        start: np.concatenate(
            [one[trial.valid] for trial, one in zip(trials, raw, strict=True) if trial.initialisation == start]
        ).mean(axis=0)
        for start in {trial.initialisation for trial in trials}
    }
    return [one - offsets[trial.initialisation] for trial, one in zip(trials, raw, strict=True)]


def raw_residuals(trials: Sequence[Trial], simulated: Sequence[Array]) -> list[Array]:
    """Return measured - simulated (n, joints) [rad] of each trial, nothing removed; nan where bridged."""
    return [
        np.where(trial.valid[:, None], trial.position - positions, np.nan)
        for trial, positions in zip(trials, simulated, strict=True)
    ]


def normalised_fit(trials: Sequence[Trial], errors: Sequence[Array], joints: Sequence[str]) -> dict[str, float]:
    """Compute the NRMSE fit of each joint's motion [%]: 100 (1 - |error| / |position - mean|).

    A perfect model has 100, one that predicts the mean 0, a worse one a negative fit. The mean is each trial's own.
    The fit of a joint that never moves is also 0.
    Source: Ljung, System Identification, 1999; `compare` of MATLAB's System Identification Toolbox.
    """
    squares = np.nansum([np.nansum(error**2, axis=0) for error in errors], axis=0)
    moved = [trial.position[trial.valid] - trial.position[trial.valid].mean(axis=0) for trial in trials]
    motion = np.sum([np.sum(one**2, axis=0) for one in moved], axis=0)
    fits = 100.0 * (1.0 - np.sqrt(squares / np.where(motion > 0.0, motion, np.inf)))
    return dict(zip(joints, map(float, np.where(motion > 0.0, fits, 0.0)), strict=True))


def free_run_error(recording: Recording, simulated: Sequence[Simulated]) -> ErrorSummary:
    """Return the RMS error [rad] of a recording's trials simulated freely."""
    return summarise_errors(residuals(recording.trials, [one.position for one in simulated]), recording.joints)


def summarise_errors(errors: Sequence[Array], joints: Sequence[str]) -> ErrorSummary:
    """Return the RMS of residuals (n, joints), nan left out, overall and per joint."""
    squares = np.concatenate([error**2 for error in errors])
    by_joint = np.sqrt(np.nanmean(squares, axis=0))
    return ErrorSummary(float(np.sqrt(np.nanmean(squares))), dict(zip(joints, map(float, by_joint), strict=True)))


WINDOW = 0.2  # [s] over which the error is averaged
FAILING = 3.0  # error / noise floor
SHORTEST = 0.1  # [s]


@dataclass(frozen=True)
class FailingInterval:
    """An interval from `start` to `end` [s] of one trial in which a joint's RMS error [rad] is far above the floor."""

    trial: str
    joint: str
    start: float
    end: float
    error: float


def failing_intervals(trial: str, joint: str, time: Array, residual: Array, floor: float) -> list[FailingInterval]:
    """Return where the RMS over 0.2 s exceeds three noise floors; `residual` (n,) [rad], nan where bridged."""
    step = float(time[1] - time[0])
    squares = np.nan_to_num(residual) ** 2
    window = max(1, round(WINDOW / step))
    rms = np.sqrt(np.convolve(squares, np.ones(window) / window, mode="same"))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (rms > FAILING * floor).astype(int), [0]])))
    return [
        FailingInterval(trial, joint, float(time[a]), float(time[b - 1]), float(np.sqrt(squares[a:b].mean())))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - a) * step >= SHORTEST
    ]


SPREAD = 0.03  # [rad] standard deviation of a joint offset. Source: Sievers et al., ICRA 2022: up to 3 deg
DIFFERENCE = 0.005  # [rad] finite difference
ITERATIONS = 4
LARGEST_OFFSET = 0.15  # [rad] no initialisation is further off; a servo that is mounted a few degrees off is within
LARGEST_STEP = 0.02  # [rad] the simulation is far from linear where joints stick
CORRELATED = 50.0  # samples that the error of a wrong model counts as one


def with_fitted_offsets(simulator: Simulator, model: Model) -> Model:
    """Return the model with joint offsets fitted to the trials of each initialisation, starting from zero.

    An offset not only shifts the reading: gravity and all else that depends on the angle change too.
    """
    model = replace(model, offsets={key: np.zeros_like(value) for key, value in model.offsets.items()})
    units = DIFFERENCE * np.eye(len(simulator.recording.joints))
    for _ in range(ITERATIONS):
        moved = [replace(model, offsets={key: value + unit for key, value in model.offsets.items()}) for unit in units]
        left, *changed = _errors(simulator, [model, *moved])
        tried = {
            key: _step(offset, left[key], np.stack([(left[key] - one[key]) / DIFFERENCE for one in changed], axis=1))
            for key, offset in model.offsets.items()
        }
        (after,) = _errors(simulator, [replace(model, offsets=tried)])
        better = {key for key in tried if np.sum(after[key] ** 2) < np.sum(left[key] ** 2)}
        model = replace(model, offsets={key: (tried if key in better else model.offsets)[key] for key in tried})
    return model


def _step(offset: Array, error: Array, slopes: Array) -> Array:
    """Return one initialisation's offset (joints,) [rad] after a regularised, clipped Gauss-Newton step."""
    trust = CORRELATED * float(np.mean(error**2)) / SPREAD**2
    normal = slopes.T @ slopes + trust * np.eye(len(offset))
    step = np.linalg.solve(normal, slopes.T @ error - trust * offset)
    return np.asarray(np.clip(offset + np.clip(step, -LARGEST_STEP, LARGEST_STEP), -LARGEST_OFFSET, LARGEST_OFFSET))


def _errors(simulator: Simulator, models: Sequence[Model]) -> list[dict[int, Array]]:
    """Return, for each model, initialisation -> concatenated residuals of its trials [rad], 0 at bridged samples."""
    trials, found = simulator.recording.trials, []
    for runs in simulator.free_runs(models):
        errors = residuals(trials, [run.position for run in runs])
        rows: dict[int, list[Array]] = {}
        for trial, error in zip(trials, errors, strict=True):
            rows.setdefault(trial.initialisation, []).append(np.nan_to_num(error).ravel())
        found.append({key: np.concatenate(parts) for key, parts in rows.items()})
    return found
