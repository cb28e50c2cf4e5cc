"""Free-running simulation of a recording: the trial's commands from the trial's start, never corrected afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import COMMAND, LEAD, MOTOR_POSITION, POSITION, TORQUE, catalogue, resolve
from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import Coupling, RigidBodyTree
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.jump_ratio import gaps, jump_ratio
from tactile_cube.measurement.replay.known_force import force_torque
from tactile_cube.measurement.replay.parameters import TORQUE_MODE_GAIN, Parameters
from tactile_cube.measurement.replay.read_out import free_way, half_jumps, impulses, read_out

if TYPE_CHECKING:
    from tactile_cube.simulation.rig import RigWorld

Array = NDArray[np.float64]
SIGNALS = np.array([MOTOR_POSITION, TORQUE, COMMAND, LEAD])
Engine = Literal["fast", "pybullet"]
HISTORY = 0.15  # [s] of the first command played before the trial, for effects with a memory
START_WINDOW = 0.02  # [s] over which the state at the start is read
CLAMPED = 1e9  # [N m] brake torque of a clamped link


@dataclass(frozen=True)
class Simulated:
    """Signals of one simulated trial, each (n, joints): position on the motor side [rad] and torque [N m]."""

    position: Array
    torque: Array


def replay(recording: Recording, parameters: Parameters, engine: Engine, step: float) -> list[Simulated]:
    """Every trial of a recording simulated freely from its start.

    Args:
        recording: rig and trials.
        parameters: the numbers of the simulation.
        engine: `fast` (joint dynamics in closed form) or `pybullet` (the world that training uses).
        step: longest integration step [s].
    """
    simulator = Replay(recording, [name for name, _ in parameters.effects], step, engine)
    try:
        return simulator.simulate(recording.trials, parameters)
    finally:
        simulator.close()


def effect_names(model: ModelFile | None) -> list[str]:
    """`NAME@JOINT` of every effect of a model on the drivetrain."""
    return [one.effect for one in model.drive_effects] if model is not None else []


class Replay:
    """Simulates the trials of a recording in the drivetrain that training uses, joint dynamics in closed form."""

    def __init__(
        self, recording: Recording, effects: Sequence[str] = (), step: float = 0.002, engine: Engine = "fast"
    ) -> None:
        """Build the simulation.

        Args:
            recording: rig, controller and trials.
            effects: `NAME@JOINT` of every effect that the parameters may name.
            step: longest integration step [s]; a whole number of steps fits between two samples.
            engine: `fast` or `pybullet`.

        Raises:
            InputError: an unknown engine or effect.
        """
        if engine not in get_args(Engine):
            raise InputError(f"engine={engine}: unknown; choose one of {', '.join(get_args(Engine))}")
        self.recording = recording
        self.substeps = recording.substeps(step)
        coupled = {name: Coupling(c.joint, c.ratio, c.offset) for name, c in recording.coupled.items()}
        self.tree = RigidBodyTree.from_urdf(recording.urdf, recording.joints, coupled)
        self._classes = {name: resolve([name], recording.joints) for name in effects}
        named = [cls for pairs in self._classes.values() for cls, _ in pairs]
        self.plant = Plant(
            [self.tree],
            dt=recording.step / self.substeps,
            # the whole catalogue: one kernel, compiled once, for every model of this rig
            effects=tuple(dict.fromkeys([*catalogue().values(), *named])),
            joint_names=recording.joints,
        )
        self._world = _pybullet(self.plant) if engine == "pybullet" else None

    def close(self) -> None:
        """End the physics server, if there is one."""
        if self._world is not None:
            self._world.close()

    def simulate(self, trials: Sequence[Trial], parameters: Parameters) -> list[Simulated]:
        """Each trial simulated from its measured start."""
        memory = np.stack([self._memory(trial, parameters) for trial in trials])
        history = round(HISTORY / self.recording.step) * self.substeps
        rows = np.array([len(trial.time) * self.substeps + self.substeps for trial in trials], dtype=np.int64)
        commands = np.stack([self._commands(trial, history, int(rows.max())) for trial in trials])
        out = np.zeros((len(trials), rows.max(), len(SIGNALS), commands.shape[2]))
        rollout_batch = (self._world or self.plant.kernel).rollout_batch
        before = memory.copy()
        rollout_batch(commands, np.arange(len(trials)), rows, history, 1, memory, SIGNALS, out)
        ratios = [jump_ratio(self.plant, before[b], commands[b, 0]) for b in range(len(trials))]
        widths = [gaps(self.plant, one) for one in before]
        return [
            self._read(trial, out[b, : rows[b]], ratios[b], widths[b], parameters) for b, trial in enumerate(trials)
        ]

    def _commands(self, trial: Trial, history: int, rows: int) -> Array:
        """Commands of every step as positions [rad], the first one held before the trial and the last one after it."""
        scale = TORQUE_MODE_GAIN if self.recording.torque_controlled else 1.0
        fine = impulses(trial.command / scale, self.substeps)
        return np.pad(fine, ((history, rows - len(fine)), (0, 0)), mode="edge")

    def _read(
        self, trial: Trial, signals: Array, ratios: tuple[Array, Array], gap: Array, parameters: Parameters
    ) -> Simulated:
        """What the log would show of the signals of all steps ((n + 1) substeps, signals, joints)."""
        position, torque, _, lead = np.moveaxis(signals[:: self.substeps], 1, 0)
        jump = half_jumps(signals[:, 2], self.substeps)
        free = free_way(lead, jump, gap)
        # Either way the drive still feels the old command: a loop reads first and commands then.
        shown = slice(None, -1) if self.recording.read == "before" else slice(1, None)
        limit = self._constants(trial, parameters)["torque_limit"]
        return Simulated(*read_out(position[shown], torque[shown], jump[shown], ratios, limit, free[shown]))

    def _memory(self, trial: Trial, parameters: Parameters) -> Array:
        own = self._constants(trial, parameters)
        constants = DrivetrainConstants(
            kp=own["kp"],
            kd=own["kd"],
            torque_limit=own["torque_limit"],
            stiffness=own["stiffness"],
            static_friction=own["static_friction"],
            reflected_inertia=own["reflected_inertia"],
        )
        effects = [
            cls(joint, **values) for name, values in parameters.effects for cls, joint in self._classes[name]
        ]  # fmt: skip
        memory: Array = self.plant.memory(constants, gravity=self.recording.gravity, effects=effects)
        self.plant.view(memory, "friction_creep")[:] = own.get("friction_creep", 0.0)
        self.plant.view(memory, "offset")[0] += self.tree.ratio * parameters.offset[self.tree.follow]
        self.plant.view(memory, "angle_offset")[:] = parameters.offset
        position, velocity, torque = self.start(trial)
        deflection = torque / parameters.constants["stiffness"]
        self.plant.reset(memory, position - deflection, velocity)
        further = self._further_reading(memory, trial.command[0])
        self.plant.reset(memory, position - deflection - further, velocity)
        self.plant.view(memory, "reading")[:] = 0  # at the beginning of each period; read_out looks at its end
        if trial.clamped:
            self.plant.view(memory, "brake")[:] = CLAMPED
        if trial.force is not None:
            self.plant.view(memory, "external_torque")[:] = force_torque(
                self.tree, trial.force, trial.position.mean(axis=0)
            )
        return memory

    def _further_reading(self, memory: Array, command: Array) -> Array:
        """What effects add to the sensor's reading beside the drive's deflection (n,) [rad], in a step of a copy."""
        scale = TORQUE_MODE_GAIN if self.recording.torque_controlled else 1.0
        copy = memory.copy()
        self.plant.kernel.step(command / scale, copy)
        position, motor, torque = (self.plant.signal(copy, row) for row in (POSITION, MOTOR_POSITION, TORQUE))
        further: Array = motor - position - self.plant.view(memory, "compliance") * torque
        return further

    def _constants(self, trial: Trial, parameters: Parameters) -> dict[str, Array]:
        """The constants of one trial: gains scaled as the trial's own are to the recording's."""
        constants = dict(parameters.constants)
        if not self.recording.torque_controlled:
            for key in ("kp", "kd", "torque_limit"):
                own, common = getattr(trial.gains, key), getattr(self.recording.gains, key)
                if not np.array_equal(own, common):
                    constants[key] = np.where(common > 0, constants[key] * own / np.where(common > 0, common, 1), own)
        return constants

    def start(self, trial: Trial) -> tuple[Array, Array, Array]:
        """Position [rad], velocity [rad/s] and torque [N m] at the trial's first sample, each (joints,)."""
        n = max(3, round(START_WINDOW / trial.step))
        slope, level = np.polyfit(trial.time[:n], trial.position[:n], 1)
        if self.recording.read == "after":
            level = level - slope * trial.step
        if trial.torque is not None:
            return level, slope, trial.torque[: max(1, n // 3)].mean(axis=0)
        if self.recording.torque_controlled:
            return level, slope, trial.command[0]
        torque = trial.gains.kp * (trial.command[0] - level) - trial.gains.kd * slope
        return level, slope, np.clip(torque, -trial.gains.torque_limit, trial.gains.torque_limit)


def _pybullet(plant: Plant) -> "RigWorld":
    """The PyBullet world, imported here because PyBullet greets everybody who imports it."""
    from tactile_cube.simulation.rig import RigWorld

    return RigWorld(plant)
