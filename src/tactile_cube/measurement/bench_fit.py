"""What the bench tests say: kp from known forces, the drive's stiffness from clamped links, offsets from touches."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.comparing.regimes import latest_direction
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.known_force import force_torque

Array = NDArray[np.float64]
SETTLED = 0.5  # last share of a trial, at rest
LEAST_TORQUE = 0.03  # [N m] a weaker pull says nothing about kp
LONG_ENOUGH = 0.5  # [s] of a command at rest, after which the joint rests too
OFFSET = 0.02  # [rad] of a joint, as large as a new initialisation brings it
CONFIDENCE = 0.95


@dataclass(frozen=True)
class BenchEstimates:
    """Values with 95 % intervals.

    Attributes:
        values: kp [N m/rad] and stiffness [N m/rad], each joint -> estimate, as far as there were trials.
        offsets: joint -> mean of the offsets [rad], with the interval that the initialisations span.
    """

    values: dict[str, dict[str, Estimate]] = field(default_factory=dict)
    offsets: dict[str, Estimate] = field(default_factory=dict)

    def into(self, model: ModelFile) -> ModelFile:
        """The model with these values in place of its own."""
        values = {key: dict(by_joint) for key, by_joint in model.values.items()}
        for key, by_joint in self.values.items():
            values[key] = values.get(key, {}) | by_joint
        return model.model_copy(update={"values": values, "offsets": model.offsets | self.offsets})


def bench_estimates(recording: Recording) -> BenchEstimates:
    """Evaluate the bench tests of a recording; without any the result is empty."""
    values: dict[str, dict[str, Estimate]] = {}
    forced = [trial for trial in recording.trials if trial.force is not None]
    clamped = [trial for trial in recording.trials if trial.clamped]
    touches = [trial for trial in recording.trials if trial.touch is not None]
    if forced:
        values["kp"] = _gains(recording, forced)
    if clamped:
        values["stiffness"] = _stiffnesses(recording, clamped)
    return BenchEstimates({key: found for key, found in values.items() if found}, _offsets(recording, touches, values))


def _gains(recording: Recording, trials: Sequence[Trial]) -> dict[str, Estimate]:
    """The gain kp of each joint: the torque that the drive must hold, over command minus position.

    The intervals allow for joint offsets, which turn the levers of the forces.
    """
    tree = recording.rigid_body()
    rests = [_rest(trial) for trial in trials]
    errors = np.array([error for _, error in rests])
    starts = np.array([trial.initialisation for trial in trials])

    def slopes(offset: Array) -> list[Estimate | None]:
        held = np.array([_held(recording, tree, t, p + offset) for t, (p, _) in zip(trials, rests, strict=True)])
        groups = [starts == start for start in np.unique(starts)]
        return [_slope(np.stack([e, *groups], axis=1), h, "N m/rad") for e, h in zip(errors.T, held.T, strict=True)]

    pulls = np.array([_pull(tree, t, p) for t, (p, _) in zip(trials, rests, strict=True)])
    central = slopes(np.zeros(len(recording.joints)))
    turned = [slopes(row) for row in np.diag(np.full(len(recording.joints), OFFSET))]
    found = {}
    for index, joint in enumerate(recording.joints):
        estimate, others = central[index], [row[index] for row in turned]
        if estimate is not None and np.abs(pulls[:, index]).max() > LEAST_TORQUE:
            changes = [one.value - estimate.value for one in others if one is not None]
            half = float(np.hypot(estimate.high - estimate.value, np.linalg.norm(changes)))
            low, high = estimate.value - half, estimate.value + half
            found[joint] = Estimate(value=estimate.value, low=low, high=high, unit=estimate.unit)
    return found


def _pull(tree: RigidBodyTree, trial: Trial, position: Array) -> Array:
    """Torques (joints,) [N m] of the trial's known force."""
    return np.zeros(len(position)) if trial.force is None else force_torque(tree, trial.force, position)


def _held(recording: Recording, tree: RigidBodyTree, trial: Trial, position: Array) -> Array:
    """What the drives must hold (joints,) [N m]: the links' weight less what the known force takes."""
    weight = tree.equations(tree.expand(position), np.zeros(tree.dofs), recording.gravity)[1]
    return np.asarray(tree.coupling.T @ weight - _pull(tree, trial, position))


def _rest(trial: Trial) -> tuple[Array, Array]:
    """Position and command minus position, (joints,) [rad], where a trial came to rest.

    Friction stops a joint short of its balance; the mean of rests after motion up and after motion down is without it.
    """
    still = np.concatenate([[False], (np.diff(trial.command, axis=0) == 0).all(axis=1), [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    direction = latest_direction(np.diff(trial.command[:, 0], prepend=trial.command[0, 0]) / trial.step)
    both = np.stack([trial.position, trial.command - trial.position])
    rests: dict[float, list[Array]] = {}
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if (end - start) * trial.step >= LONG_ENOUGH:
            part = slice(end - round(0.4 * LONG_ENOUGH / trial.step), end)
            rests.setdefault(float(direction[start]), []).append(both[:, part].mean(axis=1))
    sides = [np.mean(side, axis=0) for way, side in rests.items() if way != 0] or [both.mean(axis=1)]
    position, error = np.mean(sides, axis=0)
    return position, error


def _stiffnesses(recording: Recording, trials: Sequence[Trial]) -> dict[str, Estimate]:
    """Stiffness of each drive: one over the slope of its position against its torque, links held still."""
    found = {}
    for index, joint in enumerate(recording.joints):
        position = np.concatenate([trial.position[:, index] for trial in trials])
        torque = np.concatenate([_torque(trial)[:, index] for trial in trials])
        number = np.repeat(np.arange(len(trials)), [len(trial.time) for trial in trials])
        columns = np.stack([torque, *(number == k for k in range(len(trials)))], axis=1)
        compliance = _slope(columns, position, "rad/(N m)")
        if compliance is not None and compliance.low > 0:
            values = (1 / compliance.value, 1 / compliance.high, 1 / compliance.low)
            found[joint] = Estimate(value=values[0], low=values[1], high=values[2], unit="N m/rad")
    return found


def _offsets(
    recording: Recording, trials: Sequence[Trial], values: dict[str, dict[str, Estimate]]
) -> dict[str, Estimate]:
    """Measured less true angle of the touching joint, the drive's deflection taken out."""
    by_joint: dict[str, list[float]] = {}
    for trial in trials:
        assert trial.touch is not None
        index = recording.joints.index(trial.touch.joint)
        stated = recording.nominal.get("stiffness", np.full(len(recording.joints), np.inf))[index]
        known = values.get("stiffness", {}).get(trial.touch.joint)
        deflection = _at_rest(trial, _torque(trial))[index] / (known.value if known is not None else stated)
        offset = float(_at_rest(trial, trial.position)[index] - deflection - trial.touch.angle)
        by_joint.setdefault(trial.touch.joint, []).append(offset)
    return {
        joint: Estimate(value=float(np.mean(found)), low=min(found), high=max(found), unit="rad")
        for joint, found in by_joint.items()
    }


def _slope(columns: Array, target: Array, unit: str) -> Estimate | None:
    """Coefficient of the first column in least squares, with its interval; None if it cannot be told."""
    freedom = len(target) - columns.shape[1]
    if freedom < 1 or np.linalg.matrix_rank(columns) < columns.shape[1]:
        return None
    solution = np.linalg.lstsq(columns, target, rcond=None)[0]
    variance = float(np.sum((target - columns @ solution) ** 2)) / freedom
    error = np.sqrt(variance * np.linalg.inv(columns.T @ columns)[0, 0]) * stats.t.ppf((1 + CONFIDENCE) / 2, freedom)
    value = float(solution[0])
    return Estimate(value=value, low=value - float(error), high=value + float(error), unit=unit)


def _at_rest(trial: Trial, signal: Array) -> Array:
    """Mean (joints,) over the end of a trial."""
    return np.asarray(signal[round(SETTLED * len(signal)) :].mean(axis=0))


def _torque(trial: Trial) -> Array:
    """Measured torque, or the one that the controller must have asked for, (n, joints) [N m]."""
    if trial.torque is not None:
        return trial.torque
    asked = trial.gains.kp * (trial.command - trial.position) - trial.gains.kd * trial.velocity()
    return np.clip(asked, -trial.gains.torque_limit, trial.gains.torque_limit)
