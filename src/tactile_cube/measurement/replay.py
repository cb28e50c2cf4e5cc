"""Free-running simulation of a recording: the trial's commands from the trial's start, never corrected afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import resolve
from tactile_cube.hand.rigid_body import Coupling, RigidBodyTree
from tactile_cube.measurement.known_force import force_torque
from tactile_cube.measurement.parameters import TORQUE_MODE_GAIN, Parameters
from tactile_cube.measurement.recording import Recording
from tactile_cube.measurement.trial import Trial

Array = NDArray[np.float64]
HISTORY = 0.15  # [s] of the first command played before the trial, for effects with a memory
START_WINDOW = 0.02  # [s] over which the state at the start is read
CLAMPED = 1e9  # [N m] brake torque of a clamped link


@dataclass(frozen=True)
class Simulated:
    """Signals of one simulated trial, each (n, joints): position on the motor side [rad] and torque [N m]."""

    position: Array
    torque: Array


class Replay:
    """Simulates the trials of a recording in the drivetrain that training uses, joint dynamics in closed form."""

    def __init__(self, recording: Recording, effects: Sequence[str] = (), step: float = 0.002) -> None:
        """Build the simulation.

        Args:
            recording: rig, controller and trials.
            effects: `NAME@JOINT` of every effect that the parameters may name.
            step: longest integration step [s]; a whole number of steps fits between two samples.
        """
        self.recording = recording
        self.substeps = max(1, int(np.ceil(recording.step / step - 1e-6)))
        coupled = {name: Coupling(c.joint, c.ratio, c.offset) for name, c in recording.coupled.items()}
        self.tree = RigidBodyTree.from_urdf(recording.urdf, recording.joints, coupled)
        self._classes = {name: resolve([name], recording.joints) for name in effects}
        classes = {cls for pairs in self._classes.values() for cls, _ in pairs}
        self.plant = Plant(
            [self.tree],
            dt=recording.step / self.substeps,
            effects=tuple(sorted(classes, key=lambda cls: cls.name)),
            joint_names=recording.joints,
        )

    def simulate(self, trials: Sequence[Trial], parameters: Parameters) -> list[Simulated]:
        """Each trial simulated from its measured start."""
        memory = np.stack([self._memory(trial, parameters) for trial in trials])
        history = round(HISTORY / self.recording.step)
        rows = np.array([len(trial.time) for trial in trials], dtype=np.int64)
        commands = np.zeros((len(trials), history + rows.max(), len(self.recording.joints)))
        for block, trial in enumerate(trials):
            command = self._positions(trial, parameters)
            commands[block, :history] = command[0]
            commands[block, history : history + len(command)] = command
        position = np.zeros((len(trials), rows.max(), commands.shape[2]))
        torque = np.zeros_like(position)
        self.plant.kernel.rollout_batch(
            commands, np.arange(len(trials)), rows, history, self.substeps, memory, position, torque
        )
        return [Simulated(position[b, : rows[b]], torque[b, : rows[b]]) for b in range(len(trials))]

    def _memory(self, trial: Trial, parameters: Parameters) -> Array:
        constants = DrivetrainConstants(**self._constants(trial, parameters))
        effects = [
            cls(joint, **values) for name, values in parameters.effects for cls, joint in self._classes[name]
        ]  # fmt: skip
        memory: Array = self.plant.memory(constants, gravity=self.recording.gravity, effects=effects)
        self.plant.view(memory, "offset")[0] += self.tree.ratio * parameters.posture[self.tree.follow]
        position, velocity, torque = self.start(trial)
        self.plant.reset(memory, position - torque / parameters.constants["stiffness"], velocity)
        if trial.clamped:
            self.plant.view(memory, "brake")[:] = CLAMPED
        if trial.force is not None:
            self.plant.view(memory, "external_torque")[:] = force_torque(self.tree, trial.force, position)
        return memory

    def _constants(self, trial: Trial, parameters: Parameters) -> dict[str, Array]:
        """The constants of one trial: gains scaled as the trial's own are to the recording's."""
        constants = dict(parameters.constants)
        if not self.recording.torque_controlled:
            for key in ("kp", "kd", "torque_limit"):
                own, common = getattr(trial.gains, key), getattr(self.recording.gains, key)
                if not np.array_equal(own, common):
                    constants[key] = np.where(common > 0, constants[key] * own / np.where(common > 0, common, 1), own)
        return constants

    def _positions(self, trial: Trial, parameters: Parameters) -> Array:
        """Commands as positions [rad]; a commanded torque becomes the position that asks for it."""
        return trial.command / TORQUE_MODE_GAIN if self.recording.torque_controlled else trial.command

    def start(self, trial: Trial) -> tuple[Array, Array, Array]:
        """Position [rad], velocity [rad/s] and torque [N m] at the trial's first sample, each (joints,)."""
        n = max(3, round(START_WINDOW / trial.step))
        slope, level = np.polyfit(trial.time[:n], trial.position[:n], 1)
        if trial.torque is not None:
            return level, slope, trial.torque[: max(1, n // 3)].mean(axis=0)
        if self.recording.torque_controlled:
            return level, slope, trial.command[0]
        torque = trial.gains.kp * (trial.command[0] - level) - trial.gains.kd * slope
        return level, slope, np.clip(torque, -trial.gains.torque_limit, trial.gains.torque_limit)
