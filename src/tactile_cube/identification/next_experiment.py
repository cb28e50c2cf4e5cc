"""The commands that would tell rival explanations apart: simulated under every rival, the most telling written down.

Telling is what a rival still gets wrong after it was refitted to what the other one predicts (Atkinson and Fedorov, The
design of experiments for discriminating between two rival models, Biometrika 62, 1975).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray
from scipy.linalg import block_diag

from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.base import offset_unknowns
from tactile_cube.identification.fitting.gauss_newton import Fit, precision
from tactile_cube.identification.fitting.problem import Problem
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.fitting.time_step import FINER, finer
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import Model

Array = NDArray[np.float64]
FILE = "next_experiment.csv"
DURATION = 12.0  # [s] of a finger
FASTEST = 1.5  # times the fastest command of the recording: known to be safe, with a little more


@dataclass(frozen=True)
class Experiment:
    """Commands and what they are expected to show.

    Attributes:
        name: kind of excitation.
        joints: columns of the commands.
        time: (T,) [s].
        commands: (T, n) [rad].
        told: how many times over the evidence that decides between two explanations is expected: the least of those
            pairs that can be told apart.
        joint: where the models of the least told of these pairs differ most.
        predictions: explanation -> (T, n) [rad], before any refit.
        inseparable: pairs that none of the commands tells apart.
    """

    name: str
    joints: tuple[str, ...]
    time: Array
    commands: Array
    told: float
    joint: str
    predictions: dict[str, Array]
    inseparable: tuple[tuple[str, str], ...] = ()

    @property
    def decides(self) -> bool:
        """Whether it is worth playing."""
        return self.told > 1.0

    def write(self, folder: Path) -> Path:
        """next_experiment.csv: time and the commands, in the columns of a recording."""
        columns = {"time": self.time}
        columns |= {f"{name}.command": self.commands[:, j] for j, name in enumerate(self.joints)}
        path = folder / FILE
        pl.DataFrame(columns).write_csv(path, float_precision=8)
        return path


def next_experiment(
    shooting: Shooting,
    recording: Recording,
    rivals: dict[str, Fit],
    noise: Array,
    seed: int = 0,
    criteria: Criteria = STANDARD,
    extended: bool = False,
) -> Experiment:
    """The excitation that tells most between the first explanation and the one hardest to tell from it.

    Args:
        shooting: simulates the explanations.
        recording: what has been played so far.
        rivals: explanations and their fits on the recording, two or more; the first is compared with each other one.
        noise: (n,) of the position sensors [rad].
        seed: of the commands' phases.
        criteria: what decides between two explanations.
        extended: the others are the first one and an effect more, which no trial speaks against that shows no such
            effect: all that counts is whether it would show.
    """
    excitations = safe_excitations(recording, seed, shooting.time)
    trials = [_trial(recording, name, commands) for name, commands in excitations.items()]
    whole = finer(shooting.cut(recording, noise, trials, segment=len(trials[0].time)), FINER)
    names, fits = list(rivals), list(rivals.values())
    predicted = shooting.finer(FINER).positions([_without_offsets(one.model) for one in fits], whole)
    shown = [[_measured(trial, one) for trial, one in zip(trials, by_trial, strict=True)] for by_trial in predicted]

    def told_by(true: int, wrong: int) -> Array:
        return _told(shooting, recording, shown[true], fits[true], fits[wrong], noise, criteria)

    told = np.array([told_by(k, 0) for k in range(1, len(fits))])
    if not extended:
        told = np.minimum(told, [told_by(0, k) for k in range(1, len(fits))])
    separable = told.max(axis=1) > 1.0
    counted = np.where(separable[:, None], told, np.inf) if separable.any() else told
    best = int(np.argmax(counted.min(axis=0)))
    least = 1 + int(np.argmin(counted[:, best]))
    apart = np.sqrt(np.mean((predicted[0, best] - predicted[least, best]) ** 2, axis=0))
    return Experiment(
        trials[best].kind,
        recording.joints,
        trials[best].time,
        trials[best].command,
        float(counted[:, best].min()),
        recording.joints[int(np.argmax(apart))],
        dict(zip(names, predicted[:, best], strict=True)),
        tuple((names[0], name) for name, one in zip(names[1:], separable, strict=True) if not one),
    )


def _told(
    shooting: Shooting,
    recording: Recording,
    trials: list[Trial],
    true: Fit,
    wrong: Fit,
    noise: Array,
    criteria: Criteria,
) -> Array:
    """How many times over each trial (trials,) alone tells a wrong model from the true one, which predicted it.

    The wrong one is refitted in one step, no further than the recording before lets it. What it then keeps is compared
    with what speaks against an explanation (`worse`), the error counting that the simulation's own steps make of the
    true one: what differs in fine steps is the machine's, the rest is the simulation's.
    """
    problem = Problem(shooting, shooting.cut(recording, noise, trials))
    fine = shooting.finer(FINER)

    def in_fine_steps(model: Model) -> Array:
        windows = problem.windows
        return windows.by_segment(fine.positions([model], finer(windows, FINER))[0])

    true_model, model = _without_offsets(true.model), _without_offsets(wrong.model)
    problem.linearise_starts(true_model)
    expected = in_fine_steps(true_model)
    of_steps = problem.limited(expected - problem.predictions([true_model])[0]) * problem.weight
    blurred = problem.cost(of_steps)
    problem.linearise_starts(model)
    residual = problem.limited(expected - in_fine_steps(model)) * problem.weight
    unknowns, known = _known(recording.with_trials(trials), wrong, shooting.sizes)
    _, columns = problem.columns(model, unknowns)
    times = []
    for trial in range(len(trials)):
        rows = problem.segment_trial == trial
        one, slopes = problem.free(residual * rows[:, None]), problem.free(columns * rows[:, None, None])
        pull = np.einsum("grp,gr->p", columns, one, optimize=True)
        gram = np.einsum("grp,grq->pq", columns, slopes, optimize=True)
        left = float(np.sum(residual * one) - pull @ np.linalg.pinv(gram + known) @ pull)
        times.append(left / (criteria.clear + criteria.large_gain * float(blurred[rows].sum())))
    return np.array(times)


def _known(trials: Recording, fitted: Fit, sizes: Mapping[str, Scales]) -> tuple[tuple[Unknown, ...], Array]:
    """The unknowns of a fit, with joint offsets of new trials for its own, and the information (P, P) on them."""
    offsets = offset_unknowns(trials, sizes)
    others = [k for k, unknown in enumerate(fitted.unknowns) if unknown.kind != "offset"]
    covariance = np.linalg.pinv(fitted.information + np.diag(precision(fitted.unknowns)))[np.ix_(others, others)]
    known = block_diag(np.linalg.pinv(covariance), np.diag(precision(offsets)))
    return (*(fitted.unknowns[k] for k in others), *offsets), np.asarray(known)


def safe_excitations(recording: Recording, seed: int, unit: float = 1.0) -> dict[str, Array]:
    """Commands (T, n) inside the positions and near the speeds that the recording has shown to be safe."""
    everything = np.concatenate([trial.command for trial in recording.trials])
    low, high = everything.min(axis=0), everything.max(axis=0)
    fastest = max(np.abs(np.diff(trial.command, axis=0)).max() / trial.step for trial in recording.trials)
    time: Array = np.arange(round(DURATION * unit / recording.step), dtype=np.float64) * recording.step / unit
    rng = np.random.default_rng(seed)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(low))
    waves = {
        "slow triangles": _triangle(time[:, None] / 6.0 + phases / 6.3),
        "fast triangles": _triangle(time[:, None] / 1.0 + phases / 6.3),
        "growing triangles": (time[:, None] / time[-1]) ** 2 * _triangle(time[:, None] / 1.5 + phases / 6.3),
        "tiny triangles": 0.05 * _triangle(time[:, None] / 2.0 + phases / 6.3),
        "growing steps": (0.1 + 0.9 * time[:, None] / time[-1])
        * np.sign(np.sin(2 * np.pi * time[:, None] / 1.6 + phases)),
        "rising frequency": 0.4 * np.sin(2 * np.pi * (0.2 * time[:, None] + 0.3 * time[:, None] ** 2) + phases),
        "holds with small moves": _holds(time, len(low), rng),
    }
    return {name: _limited(middle + half * wave, FASTEST * fastest * recording.step) for name, wave in waves.items()}


def _triangle(turns: Array) -> Array:
    return np.asarray(2.0 * np.abs(2.0 * (turns - np.floor(turns + 0.5))) - 1.0)


def _holds(time: Array, joints: int, rng: np.random.Generator) -> Array:
    steps = rng.uniform(-0.9, 0.9, (round(time[-1]) + 1, joints))
    return np.asarray(steps[np.minimum(time.astype(int), len(steps) - 1)])


def _limited(command: Array, most: float) -> Array:
    """Commands whose change from row to row stays within what is safe."""
    safe = command.copy()
    for k in range(1, len(safe)):
        safe[k] = safe[k - 1] + np.clip(command[k] - safe[k - 1], -most, most)
    return safe


def _measured(trial: Trial, positions: Array) -> Trial:
    """A trial as a model predicts it (T, n); where its simulation ran away nothing is measured."""
    valid = np.asarray(np.isfinite(positions).all(axis=1))
    return replace(trial, position=np.where(valid[:, None], positions, trial.command), valid=valid)


def _trial(recording: Recording, name: str, commands: Array) -> Trial:
    time: Array = np.arange(len(commands), dtype=np.float64) * recording.step
    valid = np.ones(len(time), dtype=bool)
    return Trial(name, "", name, 0, time, commands, commands.copy(), None, valid, recording.gains)


def _without_offsets(model: Model) -> Model:
    zero = {0: np.zeros_like(next(iter(model.offsets.values())))}
    return Model(model.constants, model.terms, zero)
