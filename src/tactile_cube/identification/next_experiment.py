"""Commands that separate rival explanations: simulated under every rival, the best ones written down.

The best commands leave a rival the largest error after it was refitted to what the other one predicts (Atkinson and
Fedorov, The design of experiments for discriminating between two rival models, Biometrika 62, 1975).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from scipy.linalg import block_diag

from tactile_cube.drivetrain.effects.effect import Array, Scales
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit, precision
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.resolution import FINER, finer
from tactile_cube.identification.fitting.unknowns import Unknown, offset_unknowns
from tactile_cube.identification.safe_commands import PossibleMotions, Safety, covariance_of_numbers
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import Model
from tactile_cube.whole_file import write_whole

FILE = "next_experiment.csv"


@dataclass(frozen=True)
class Experiment:
    """Commands and what they are expected to show.

    Attributes:
        name: kind of excitation.
        joints: columns of the commands.
        time: (T,) [s].
        commands: (T, n) [rad].
        told: ratio of expected to required evidence, the least of the separable pairs of explanations.
        joint: where the models of that pair differ most.
        predictions: explanation -> (T, n) [rad], before any refit.
        safety: what the commands do in every model that may be true.
        inseparable: pairs that none of the commands separates.
    """

    name: str
    joints: tuple[str, ...]
    time: Array
    commands: Array
    told: float
    joint: str
    predictions: dict[str, Array]
    safety: Safety
    inseparable: tuple[tuple[str, str], ...] = ()

    @property
    def decides(self) -> bool:
        """Whether it is worth playing, and safe."""
        return self.told > 1.0 and self.safety.safe

    def write(self, folder: Path) -> Path:
        """Write next_experiment.csv: time and the commands, in the columns of a recording."""
        columns = {"time": self.time}
        columns |= {f"{name}.command": self.commands[:, j] for j, name in enumerate(self.joints)}
        path = folder / FILE
        write_whole(path, pl.DataFrame(columns).write_csv(float_precision=8).encode())
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
    """Choose the excitation that best separates the first explanation from the one hardest to distinguish from it.

    Args:
        shooting: simulates the explanations.
        recording: what has been played so far.
        rivals: explanations and their fits on the recording, two or more; the first is compared with each other one.
        noise: (n,) of the position sensors [rad].
        seed: seed of the commands' phases.
        criteria: thresholds that decide between two explanations.
        extended: the others are the first one with one more effect, so that only its visibility counts.
    """
    motions = PossibleMotions(shooting, recording, list(rivals.values()), criteria.margin)
    proposed = motions.safe_trials(seed)
    safe = [(trial, safety) for trial, safety in proposed if safety.safe]
    if not safe:
        (one, unsafe), joints = proposed[0], recording.joints
        return Experiment(one.kind, joints, one.time, one.command, 0.0, joints[0], {}, unsafe)
    trials = [trial for trial, _ in safe]
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
        safe[best][1],
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
    """Return the ratio of expected to required evidence of each trial (trials,) against a wrong model.

    The wrong one is refitted in one step, no further than the recording before lets it. What it then keeps is compared
    with what rejects an explanation (`worse`), with the error that the simulation's own steps make of the
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
        times.append(left / (criteria.band**2 + criteria.detail * float(blurred[rows].sum())))
    return np.array(times)


def _known(trials: Recording, fitted: Fit, sizes: Mapping[str, Scales]) -> tuple[tuple[Unknown, ...], Array]:
    """Return the unknowns of a fit, its joint offsets replaced by those of new trials, and their information (P, P)."""
    offsets = offset_unknowns(trials, sizes)
    covariance, others = covariance_of_numbers(fitted)
    known = block_diag(np.linalg.pinv(covariance), np.diag(precision(offsets)))
    return (*others, *offsets), np.asarray(known)


def _measured(trial: Trial, positions: Array) -> Trial:
    """Return a trial with the positions (T, n) that a model predicts; rows are invalid where it ran away."""
    valid = np.asarray(np.isfinite(positions).all(axis=1))
    return replace(trial, position=np.where(valid[:, None], positions, trial.position), valid=valid)


def _without_offsets(model: Model) -> Model:
    zero = {0: np.zeros_like(next(iter(model.offsets.values())))}
    return Model(model.constants, model.terms, zero)
