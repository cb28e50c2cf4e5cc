"""Simulation steps whose error is hidden by the sensor noise, and the final fit with 95 % intervals."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.fitting.gauss_newton import Fit, fit, precision
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.unknowns import Unknown, base_unknowns, every_effect, read_all
from tactile_cube.measurement.comparing.noise_floor import noise_with_links
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, nominal_model
from tactile_cube.measurement.replay.windows import Windows, steps_per_row

FINER = 8  # factor by which steps are refined to see the error of the model's own: 0.25 ms beside 2 ms
ENOUGH = 12  # windows in which it is measured, spread over the recording: up to 53 s of a finger


def step_shift(problem: Problem, fitted: Fit) -> Array:
    """Return the shift of the unknowns (P,) if the simulation's steps were `FINER` times as short.

    To first order: the least-squares change of the unknowns due to the change of the prediction in finer steps.
    """
    part = spread(problem.windows)
    own, fine = Problem(problem.shooting, part), Problem(problem.shooting.finer(FINER), finer(part, FINER))
    for one in (own, fine):
        one.linearise_starts(fitted.model)
    prediction, columns = own.columns(fitted.model, fitted.unknowns)
    moved = own.limited(fine.predictions([fitted.model])[0] - prediction) * own.weight
    freed = own.free(columns)
    information = np.einsum("grp,grq->pq", columns, freed, optimize=True) + np.diag(precision(fitted.unknowns))
    pull = np.einsum("grp,gr->p", freed, moved, optimize=True)
    scales = np.array([unknown.scale for unknown in fitted.unknowns])
    return np.asarray(-scales * np.linalg.solve(information, pull))


def spread(windows: Windows) -> Windows:
    """Return `ENOUGH` windows, spread over the recording, to measure the effect of the time step."""
    return windows.take(np.unique(np.linspace(0, len(windows) - 1, ENOUGH).round().astype(np.int64)))


def finer(windows: Windows, times: int) -> Windows:
    """Return the windows for simulation steps so many times as short.

    The first step of a row takes the mean of two commands, all others the later one. Where a row is one step that is
    what the next row's jump begins with; of the past, which only wakes memories, the mean is kept.
    """
    count, _, joints = windows.commands.shape
    rows = windows.commands.reshape(count, -1, windows.substeps, joints)
    held = rows[:, :, -1:].copy()
    if windows.substeps == 1:
        held[:, windows.history : -1, 0] = (held[:, windows.history + 1 :, 0] - windows.jump[:, 1:]).copy()
        held[:, -1, 0] += windows.jump[:, -1]
    fine = windows.substeps * times
    commands = np.concatenate([rows[:, :, :1], np.repeat(held, fine - 1, axis=2)], axis=2)
    return replace(windows, commands=commands.reshape(count, -1, joints), substeps=fine)


FINEST = 8  # largest factor of refinement where no rate is stated; a diagnosis takes as many times longer
HIDDEN = 0.2  # error in units of the sensor noise; its square is `criteria.least_gain`, too little to justify an effect
StepError = Callable[[Recording, int], float]
"""(recording, factor) -> change of its prediction by steps so many times as short [sensor noise]."""


def resolved(
    recording: Recording,
    effects: Sequence[type[Effect]],
    say: Callable[[str], None],
    known: ModelFile | None = None,
) -> Recording:
    """Return the recording with the longest simulation steps whose error is hidden by the noise.

    If the controller's rate is not stated, the steps may be shorter than usual: sparse rows and a fine encoder reveal
    errors of steps that suffice elsewhere, above all where torque limits are reached between two rows. If it is
    stated, the steps may be longer than its period, as the duration of a search is proportional to the steps per row.

    Args:
        recording: any.
        effects: classes to compile in; a search for them reuses their kernel.
        say: receives a line if the steps become shorter or longer.
        known: the model to simulate; None: the values that the recording's owner states.
    """
    noise = noise_with_links(recording)

    def error(one: Recording, times: int) -> float:
        start = nominal_model(one, known)
        return step_error(one, Shooting(one, every_effect(effects, start)), start, noise, times)

    unstated = recording.description.controller.rate_hz is None
    rate = (_shorter if unstated else _longer)(recording, joint_scales(recording)[0].time, error)
    if rate is None:
        return recording
    say(f"simulated at {rate:g} Hz, as its sensors call for")
    return recording.with_controller_rate(rate)


def _shorter(recording: Recording, time: float, error: StepError) -> float | None:
    """Return the rate [Hz] of the steps that suffice; None: the usual ones do."""
    left = error(recording, FINEST)
    times = next((k for k in (1, 2, 4) if left <= HIDDEN * k), FINEST)  # errors of the step are of first order
    return None if times == 1 else times * steps_per_row(recording, time) * recording.rate


def _longer(recording: Recording, time: float, error: StepError) -> float | None:
    """Return the rate [Hz] below the controller's that suffices; None: no lower one does."""
    stated, steps = (steps_per_row(one, time) for one in (recording, recording.with_controller_rate(recording.rate)))
    while steps < stated:
        rate = steps * recording.rate
        if stated % steps:
            steps += 1
        elif error(recording.with_controller_rate(rate), stated // steps) <= HIDDEN:
            return rate
        else:
            steps *= 2
    return None


def step_error(recording: Recording, shooting: Shooting, model: Model, noise: Array, times: int) -> float:
    """Return RMS [sensor noise] by which steps so many times as short move what constants and starts cannot follow."""
    windows = spread(shooting.cut(recording, noise))
    own, fine = Problem(shooting, windows), Problem(shooting.finer(times), finer(windows, times))
    for problem in (own, fine):
        problem.linearise_starts(model)
    prediction, columns = own.columns(model, base_unknowns(recording, model.constants, shooting.sizes))
    moved = own.limited(fine.predictions([model])[0] - prediction) * own.weight
    flat, free = columns.reshape(-1, columns.shape[-1]), own.free(columns).reshape(-1, columns.shape[-1])
    share = np.linalg.lstsq(free.T @ flat, free.T @ moved.ravel(), rcond=None)[0]
    left = moved - columns @ share
    return float(np.sqrt(own.cost(left).sum() / np.count_nonzero(own.weight)))


NORMAL_95 = 1.96
UNDECIDED = 0.1  # squared error, in units of the residual's variance; 1 is a standard error of one unknown


@dataclass(frozen=True)
class Fitted:
    """The final fit.

    Attributes:
        model: with the fitted values.
        fit: where they come from.
        half_width: (P,) of the 95 % interval that noise and misfit leave each unknown.
        step_shift: (P,) by which each unknown would move in much shorter simulation steps.
    """

    model: Model
    fit: Fit
    half_width: Array
    step_shift: Array


def final_fit(problem: Problem, model: Model, unknowns: Sequence[Unknown], iterations: int = 12) -> Fitted:
    """Refit constants and effects of a model on all windows, with intervals.

    Where two numbers do nearly the same, the error is nearly flat along their valley: the fit goes on until a step
    gains less than the noise decides.
    """
    problem.linearise_starts(model)
    fitted = fit(problem, model, unknowns, iterations, converged=UNDECIDED / np.count_nonzero(problem.weight))
    scales = np.array([u.scale for u in fitted.unknowns])
    half_width = NORMAL_95 * standard_errors(problem, fitted) * scales
    return Fitted(fitted.model, fitted, half_width, step_shift(problem, fitted))


def standard_errors(problem: Problem, fitted: Fit) -> Array:
    """Return standard errors (P,) of the unknowns in their scales.

    The residual of an imperfect model is autocorrelated, and the same in each repeat of a command; so the scatter of
    the score is taken over segments of the same moment of a command (cluster-robust), and never less than white noise
    as large as the residual would give: of few long segments the scatter says little.
    """
    freed = problem.free(fitted.residual)
    scores = np.einsum("grp,gr->gp", fitted.columns, freed, optimize=True)
    scores = np.stack([scores[np.equal(problem.alike, one)].sum(axis=0) for one in sorted(set(problem.alike))])
    sizes, directions = np.linalg.eigh(fitted.information + np.diag(precision(fitted.unknowns)))
    sure = np.maximum(sizes, np.finfo(float).eps * sizes.max())  # what the data say nothing of may round to below zero
    inverse = (directions / sure) @ directions.T
    clusters, unknowns = scores.shape
    correction = clusters / max(clusters - unknowns, 1)
    robust = inverse @ (scores.T @ scores * correction) @ inverse
    variance = max(fitted.cost / max(float(np.count_nonzero(problem.weight)), 1.0), 1.0)
    return np.asarray(np.sqrt(np.maximum(np.diag(robust), variance * np.diag(inverse))))


def needless(model: Model, fitted: Fit, half_width: Array, first: int) -> set[int]:
    """Return the terms from `first` on whose numbers may be what changes nothing, the least certain taken out first.

    What the others become without it follows from the fit's covariance, as large as its intervals (P,) say (Wald's
    test).
    """
    places = np.array([u.place if u.kind == "effect" else -1 for u in fitted.unknowns])
    width = np.maximum(half_width, np.finfo(float).tiny)
    away = np.array([u.of(model) - u.neutral for u in fitted.unknowns]) / width
    inverse = np.linalg.pinv(fitted.information + np.diag(precision(fitted.unknowns)), hermitian=True)
    spread = np.sqrt(np.maximum(np.diag(inverse), np.finfo(float).tiny))
    covariance = inverse / np.outer(spread, spread)
    left, out = set(range(first, len(model.terms))), set[int]()
    while left:
        sure = np.abs(away) / np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).eps))
        doubt = {place: float(sure[places == place].max(initial=0.0)) for place in left}
        least = min(doubt, key=doubt.__getitem__)
        if doubt[least] >= 1.0:
            return out
        own = places == least
        gain = covariance[:, own] @ np.linalg.pinv(covariance[np.ix_(own, own)], hermitian=True)
        away, covariance = away - gain @ away[own], covariance - gain @ covariance[own]
        left, out = left - {least}, out | {least}
    return out


def bounds(fitted: Fitted) -> dict[tuple[str, str, int, int], tuple[float, float, float]]:
    """Return (kind, key, place, initialisation) -> value and interval, cut at the unknown's own bounds.

    The value is the best one in the model's own steps. The interval reaches from there to the best one in much shorter
    steps, and beyond both by the half width.
    """
    values = read_all(fitted.model, fitted.fit.unknowns)
    below = fitted.half_width - np.minimum(fitted.step_shift, 0.0)
    above = fitted.half_width + np.maximum(fitted.step_shift, 0.0)
    return {
        (u.kind, u.key, u.place, u.initialisation): (
            float(value),
            float(min(max(value - less, u.low), value)),
            float(max(min(value + more, u.high), value)),
        )
        for u, value, less, more in zip(fitted.fit.unknowns, values, below, above, strict=True)
    }
