"""What the bench tests say: kp from known forces, the drive's stiffness from clamped links, offsets from touches."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tactile_cube.drivetrain.model_file import Estimate, ModelFile
from tactile_cube.hand.rigid_body import Coupling, RigidBodyTree
from tactile_cube.measurement.known_force import force_torque
from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.trial import Trial

Array = NDArray[np.float64]
SETTLED = 0.5  # last share of a trial, at rest
LEAST_TORQUE = 0.01  # [N m] a weaker pull says nothing about kp
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

    Friction takes part of a pull, always against it; its size is fitted along.
    """
    coupled = {name: Coupling(c.joint, c.ratio, c.offset) for name, c in recording.coupled.items()}
    tree = RigidBodyTree.from_urdf(recording.urdf, recording.joints, coupled)
    held, errors, pulls = [], [], []
    for trial in trials:
        position, command = _at_rest(trial, trial.position), _at_rest(trial, trial.command)
        assert trial.force is not None
        pull = force_torque(tree, trial.force, position)
        weight = tree.coupling.T @ tree.equations(tree.expand(position), np.zeros(tree.dofs), recording.gravity)[1]
        held.append(weight - pull)
        errors.append(command - position)
        pulls.append(pull)
    groups = np.array([trial.initialisation for trial in trials])
    found = {}
    for index, joint in enumerate(recording.joints):
        pull = np.array(pulls)[:, index]
        friction = np.where(np.abs(pull) > LEAST_TORQUE, -np.sign(pull), 0.0)
        columns = np.stack([np.array(errors)[:, index], friction, *(groups == g for g in np.unique(groups))], axis=1)
        estimate = _slope(columns, np.array(held)[:, index], "N m/rad")
        if np.abs(pull).max() > 3 * LEAST_TORQUE and estimate is not None:
            found[joint] = estimate
    return found


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
