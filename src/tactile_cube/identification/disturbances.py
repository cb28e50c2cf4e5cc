"""Intervals of a recording that follow no model, and commands that were logged late."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.effects.effect import Array, Effect
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.search.evidence import judge, segment_errors
from tactile_cube.identification.search.explanation import Proposal
from tactile_cube.identification.search.proposals import look
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.noise_floor import noise_with_links, repeats_of
from tactile_cube.measurement.recordings.description import MOST_LATE
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, nominal_model

STANDS_OUT = 5.0  # times what is usual: less hardly moves a fit, and a joint that sticks does it by chance
USUAL = 0.9  # share of a joint's segments with the usual error: what disturbs more belongs to the machine
SCATTER = 0.95  # share of a joint's segments whose error exceeds that of another run by no more than is usual
UNLIKE = 0.5  # share of an error that another run lacks: less of it may be a law's, in runs that start otherwise


@dataclass(frozen=True)
class Disturbance:
    """Interval of one trial in which a model fails that holds elsewhere.

    Attributes:
        trial: its name.
        start: where it begins, padded by one window [s].
        end: where it ends, likewise.
        joint: where the error is largest.
        error: RMS of that joint there, in units of the sensor noise.
        usual: the error that nine tenths of all segments of that joint do not exceed.
        repeats: other runs of the same command, none of which shows it at that time.
    """

    trial: str
    start: float
    end: float
    joint: str
    error: float
    usual: float
    repeats: int


def disturbances(search: Search, recording: Recording, model: Model) -> list[Disturbance]:
    """Return the intervals in which the model fails although it holds elsewhere and in repeats of the command.

    Where a command was repeated, a run is compared with the others: what a law misses, it misses in all of them.

    Args:
        search: cuts trials into segments and simulates them.
        recording: every trial: training, validation and test.
        model: fitted; joint offsets that it lacks are fitted here.
    """
    problem = Problem(search.shooting, search.windows(recording))
    found = model.with_offsets(nominal_model(recording, search.known).offsets)
    problem.linearise_starts(found)
    errors = segment_errors(problem, judge(problem, recording, found).residual)
    usual = np.maximum(np.nanquantile(errors, USUAL, axis=0), 1.0)
    by_trial, rows = _by_trial(problem, errors, len(recording.trials)), problem.windows.segment
    repeats = [repeats_of(recording.trials, index) for index in range(len(recording.trials))]
    beyond = [
        _beyond(own, [(by_trial[k], lag) for k, lag in others], rows)
        for own, others in zip(by_trial, repeats, strict=True)
    ]
    more = np.nan_to_num(np.maximum(np.concatenate(beyond), 0.0))
    scatter = np.maximum(np.quantile(more, SCATTER, axis=0), 1.0)
    found_in = []
    for trial, own, excess, others in zip(recording.trials, by_trial, beyond, repeats, strict=True):
        unlike = excess > np.maximum(np.maximum(STANDS_OUT * scatter, usual), UNLIKE * own)
        failing = np.flatnonzero(np.where(np.isnan(excess), own > STANDS_OUT * usual, unlike).any(axis=1))
        for first, last in _intervals(failing):
            mean = np.sqrt(np.nanmean(own[first : last + 1] ** 2, axis=0))
            joint = int(np.nanargmax(mean / usual))
            start = max((first - 1) * rows * trial.step, 0.0)
            end = min((last + 2) * rows * trial.step, trial.duration + trial.step)
            sizes = float(mean[joint]), float(usual[joint])
            found_in.append(Disturbance(trial.name, start, end, recording.joints[joint], *sizes, len(others)))
    return found_in


def undisturbed(recording: Recording, found: Iterable[Disturbance]) -> Recording:
    """Return the recording with these intervals excluded from every error, as dropped samples are."""
    left_out = {trial.name: trial.valid.copy() for trial in recording.trials}
    times = {trial.name: trial.time for trial in recording.trials}
    for one in found:
        left_out[one.trial] &= (times[one.trial] < one.start) | (times[one.trial] >= one.end)
    return recording.with_trials([replace(trial, valid=left_out[trial.name]) for trial in recording.trials])


def _by_trial(problem: Problem, errors: Array, trials: int) -> list[Array]:
    """Return the errors (segments, n) of each trial in the order of time, one row a segment."""
    windows = problem.windows
    rows = windows.segment
    found = []
    for trial in range(trials):
        mine = np.flatnonzero(windows.trial == trial)
        first = np.round(windows.time[mine] / (rows * problem.shooting.recording.step)).astype(int)
        count = int(first.max()) + windows.segments if len(mine) else 0
        own = np.full((count, errors.shape[1]), np.nan)
        for window, begin in zip(mine, first, strict=True):
            piece = errors[window * windows.segments : (window + 1) * windows.segments]
            there = own[begin : begin + windows.segments]
            own[begin : begin + windows.segments] = np.where(np.isnan(piece), there, piece)
        found.append(own)
    return found


def _beyond(own: Array, others: Sequence[tuple[Array, int]], rows: int) -> Array:
    """Return by how much errors (segments, n) exceed those of another run of the command at about that time.

    That run is the one with the least; nan where no other run was measured.
    """
    least = np.full(own.shape, np.nan)
    for errors, lag in others:
        for place in range(len(own)):
            first = place - round(lag / rows)
            near = errors[max(first - 1, 0) : max(first + 2, 0)]
            if len(near):
                least[place] = np.fmin(least[place], np.fmax.reduce(near, axis=0))
    return np.asarray(own - least)


def _intervals(failing: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return first and last segments of the failing intervals; one segment between two failing ones belongs to them."""
    if not len(failing):
        return []
    edges = np.flatnonzero(np.diff(failing) > 2)
    return [(int(part[0]), int(part[-1])) for part in np.split(failing, edges + 1)]


SEGMENTS = 32  # enough to separate late commands from laws
NEARER = -0.5  # rows: a reading that is as early comes nearer to its stamp with commands a row earlier


def in_time(
    recording: Recording,
    effects: Sequence[type[Effect]],
    say: Callable[[str], None],
    known: ModelFile | None = None,
) -> Recording:
    """Return the recording with its commands as many rows earlier as the machine moves before them.

    What is within half a row is fitted (`reading_delay`).

    Args:
        recording: any.
        effects: classes to compile in; their kernel is used again by a search for them.
        say: takes a line where they become earlier.
        known: the model to begin with; None: what the recording's owner states.
    """
    if recording.torque_controlled:
        return recording

    rows, (error, reading) = 0, _fitted(recording, effects, known)
    while reading < NEARER and rows < MOST_LATE:
        further, later = _fitted(_earlier(recording, rows + 1), effects, known)
        if further**2 > (1.0 + STANDARD.least_gain) * error**2:
            break  # where the error is alike, the time that is nearer to the stamps is taken
        rows, error, reading = rows + 1, further, later
    if not rows or (error > STANDARD.floor and not _late_beside_effects(recording, rows, effects, known)):
        return recording
    stated = recording.description.sensors.commands_late
    say(
        f"the machine moves {rows} rows ({1e3 * rows * recording.step:.3g} ms) before its commands, which were logged "
        f"late: they are taken that much earlier. Write `commands_late: {stated + rows}` below `sensors:` in "
        f"{recording.folder / DESCRIPTION}, so that every command does"
    )
    return _earlier(recording, rows)


def _fitted(recording: Recording, effects: Sequence[type[Effect]], known: ModelFile | None) -> tuple[float, float]:
    """Return the base model's error [sensor noise], and when the joint read last is read [rows after its stamp]."""
    noise = noise_with_links(recording)
    search = Search(recording, recording, noise, effects, lambda line: None, known, segments=SEGMENTS)
    base = search.fitted_base()
    return base.error, float(base.fit.model.constants["reading_delay"].max() / recording.step)


def _late_beside_effects(
    recording: Recording, rows: int, effects: Sequence[type[Effect]], known: ModelFile | None
) -> bool:
    """Return whether earlier commands clearly reduce the error that the best single effect leaves.

    Integral action or velocity feed-forward of a controller, and a spring, also make a machine seem to move before its
    command, so the catalogue's effects are included, requested or not.
    """
    effects = tuple(dict.fromkeys((*effects, *catalogue().values())))
    as_logged = _beside_an_effect(recording, effects, known)
    if as_logged <= STANDARD.adequate:
        return False
    earlier = _beside_an_effect(_earlier(recording, rows), effects, known)
    return earlier**2 < (1.0 - STANDARD.detail) * as_logged**2


def _beside_an_effect(recording: Recording, effects: Sequence[type[Effect]], known: ModelFile | None) -> float:
    """Return the error of the base model with the one effect that explains most [sensor noise]."""
    noise = noise_with_links(recording)
    search = Search(recording, recording, noise, effects, lambda line: None, known, segments=SEGMENTS)
    looks = look(search, Proposal((), search.base.fit), recording.joints)
    least = min([looks.frozen.cost, *(fitted.cost for _, fitted in looks.tried)])
    return float(np.sqrt(least / np.count_nonzero(looks.problem.weight)))


def _earlier(recording: Recording, rows: int) -> Recording:
    return recording.with_trials([trial.with_earlier_commands(rows) for trial in recording.trials])
