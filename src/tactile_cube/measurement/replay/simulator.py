"""A recorded rig in simulation: many models at once, in segments started anew or freely, on all cores."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_cube.compiled import compiled_once
from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.effects.command import IntegralAction
from tactile_cube.drivetrain.effects.effect import Effect, Stage
from tactile_cube.drivetrain.effects.friction import PreslidingFriction
from tactile_cube.drivetrain.effects.transmission import Backlash, smooth_lead
from tactile_cube.drivetrain.plant import TREE_KEYS
from tactile_cube.drivetrain.signals import COMMAND, LEAD, LOOP_GAIN, MOTOR_POSITION, POSITION, TORQUE
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.comparing.noise_floor import LEAST, sensor_noise
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.description import KnownForce
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Array, Trial
from tactile_cube.measurement.replay import read_out
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.windows import SMOOTHING, START_SPEED, Windows, asks_for_much, whole_trials

CLAMPED = 1e9  # [N m] brake torque of a clamped link
DRIVE = ("kp", "kd", "stiffness", "static_friction", "reflected_inertia", "torque_limit")
MECHANICS = (*TREE_KEYS, "gravity")  # what the equations of motion of a path depend on, but for rotors


@dataclass(frozen=True)
class Simulated:
    """Signals of one simulated trial, each (n, joints): position on the motor side [rad] and torque [N m]."""

    position: Array
    torque: Array


@dataclass(frozen=True)
class Path:
    """A model's way through windows, with the equations of motion along it, for its neighbours to follow."""

    position: Array  # what a log would show of the model, (S, K segment, sensors) [rad]
    mechanics: Array  # what the equations of motion depend on
    steps: Array  # (S, T width) of every window, see `steps.free_step`


def free_run(recording: Recording, model: Model, step: float = 0.002) -> list[Simulated]:
    """Simulate every trial of a recording freely from its start, in steps of `step` [s] at most."""
    simulator = Simulator(recording, [term.effect for term in model.terms], step)
    try:
        return simulator.free_runs([model])[0]
    finally:
        simulator.close()


class Simulator:
    """The drivetrain that training uses as a recording's rig, with every effect that a model may have compiled in."""

    def __init__(
        self, recording: Recording, effects: Sequence[type[Effect]] = (), step: float = 0.002, time: float = 1.0
    ) -> None:
        """Build the plant; its kernel is compiled once and kept on disk.

        A model may use `effects` of a user beside the catalogue. A whole number of steps of `step` [s] at most fits
        between two samples; `time` is what a second of a finger stands for [s].
        """
        self.recording = recording
        self.time = time
        self.tree = recording.rigid_body()
        self.substeps = recording.substeps(step)
        # the whole catalogue: one kernel, compiled once, for every model of this rig
        known = tuple(dict.fromkeys([*catalogue().values(), *effects]))
        self.plant = Plant([self.tree], recording.step / self.substeps, known, recording.joints)
        self.simulated = 0.0  # steps of single joints that were simulated; those that follow a path count a third
        self.workers = min(4, len(os.sched_getaffinity(0)))
        self._pool = ThreadPoolExecutor(self.workers)

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def finer(self, times: int) -> Self:
        """Return the simulator with steps shorter by the factor `times`, for windows that are refined likewise."""
        fine = copy(self)
        fine.plant = Plant([self.tree], self.plant.dt / times, self.plant.effects, self.recording.joints)
        return fine

    def free_runs(self, models: Sequence[Model], trials: Sequence[Trial] | None = None) -> list[list[Simulated]]:
        """Simulate trials of the recording, all by default, with each model freely from their measured starts."""
        trials = self.recording.trials if trials is None else trials
        noise, speed = sensors(self.recording.with_trials(list(trials)))
        windows = whole_trials(self.recording, trials, self.substeps, self.time, noise, speed)
        signals = self.simulate(models, [windows] * len(models), torques=True)
        return [
            [Simulated(*one[k, :, : len(trial.time)]) for k, trial in enumerate(trials)]
            for one in np.moveaxis(signals, 2, 1)
        ]

    def simulate(
        self,
        models: Sequence[Model],
        windows: Sequence[Windows],
        corrections: Array | None = None,
        torques: bool = False,
        near: Path | None = None,
    ) -> Array:
        """Simulate each of M models in its windows (of one shape), with its correction at the start of each segment.

        Corrections (M, 2 n) are added to positions [rad] and speeds [rad/s]. Models take their equations of motion from
        the path `near` of a neighbour, at a third of the cost; models of another mechanism compute their own.

        Returns:
            Signals as logged, (M, 1 or 2, S, K segment, sensors): positions [rad] and, if wanted, torques [N m].
        """
        out = np.zeros((len(models), 1 + torques, *windows[0].measured.shape))
        self._count(len(models) / (1 if near is None else 3), windows[0])
        if corrections is None:
            corrections = np.zeros((len(models), 2 * len(self.recording.joints)))
        whole = len(models) - len(models) % self.workers  # a model a core; the last ones' windows go to all cores
        pool = self._pool
        list(pool.map(partial(self._one, near=near), models[:whole], windows[:whole], corrections, out))
        for k in range(whole, len(models)):
            self._one(models[k], windows[k], corrections[k], out[k], pool, near)
        return out

    def path(self, model: Model, windows: Windows) -> Path:
        """Simulate a model in windows and return its path, which its neighbours may follow."""
        out = np.zeros((1, *windows.measured.shape))
        self._count(1.0, windows)
        steps = out.shape[2] * windows.substeps * self.plant.kernel.PATH_WIDTH
        path = Path(out[0], self._mechanics(self.memory(model)), np.zeros((len(windows), steps)))
        self._one(model, windows, np.zeros(2 * len(self.recording.joints)), out, self._pool, path, follows=False)
        return path

    def _count(self, models: float, windows: Windows) -> None:
        joint_steps = windows.measured.shape[1] * self.substeps * len(self.recording.joints)
        self.simulated += models * len(windows) * joint_steps

    def _mechanics(self, memory: Array) -> Array:
        return np.concatenate([self.plant.view(memory, key).ravel() for key in MECHANICS])

    def gaps(self, model: Model) -> Array:
        """Return the width of the gap in each joint's transmission (n,) [rad]."""
        return read_out.gaps(self.plant, self.memory(model))

    def integrating(self, model: Model) -> list[int]:
        """Return the joints whose controller integrates its error."""
        return integrating_joints(model, self.plant.joint_names)

    def memory(self, model: Model) -> Array:
        """Return the memory (size,) of the plant with a model's constants and effects."""
        known: dict[str, Any] = {key: model.constants[key] for key in DRIVE}
        memory: Array = self.plant.memory(DrivetrainConstants(**known), gravity=self.recording.gravity)
        self.plant.view(memory, "friction_creep")[:] = model.constants.get("friction_creep", 0.0)
        for term in model.terms:
            self.plant.set_effect(memory, term.effect, term.joint, term.values)
        return memory

    def _one(
        self,
        model: Model,
        windows: Windows,
        correction: Array,
        out: Array,
        pool: ThreadPoolExecutor | None = None,
        near: Path | None = None,
        follows: bool = True,
    ) -> None:
        memory = self._memories(model, windows)
        paths = np.zeros((len(windows), 1))
        if near is not None and (not follows or np.array_equal(near.mechanics, self._mechanics(memory[0]))):
            paths = near.steps
            self.plant.view(memory, "follows" if follows else "needs_weight")[:] = 1.0
        gap = read_out.gaps(self.plant, memory[0])
        ratios = self._jump_ratios(memory, windows)
        limit = self.plant.view(memory, "torque_limit")[:, None].copy()
        rows = np.array([MOTOR_POSITION, TORQUE, COMMAND, POSITION, *([LEAD, LOOP_GAIN] if gap.any() else [])])
        joints = len(self.recording.joints)
        signals = np.zeros((len(windows), out.shape[2] * windows.substeps, len(rows), joints))
        self._play(windows, self._past(model, windows), correction, memory, paths, rows, signals, pool)
        jump = read_out.simulated_jumps(signals[:, :, 2], windows)
        shown, every = signals[:, :: windows.substeps], memory[:, None]
        free = read_out.free_way(self.plant, every, jump, shown[:, :, 4], shown[:, :, 5]) if gap.any() else 0.0
        ratios = read_out.spring_ratios(self.plant, every, jump, shown[:, :, 1], ratios)
        position, torque = read_out.read_out(shown[:, :, 0], shown[:, :, 1], jump, ratios, limit, free)
        far = asks_for_much(jump, self.plant.view(memory, "kp")[:, None], limit)
        if far.any():
            before, known = read_out.before_steps(signals[:, :, :2], windows.segment, windows.substeps)
            far &= known[:, None]
            position, torque = np.where(far, before[:, :, 0], position), np.where(far, before[:, :, 1], torque)
        links = shown[:, :, 3, windows.joint_of[joints:]]
        out[0] = self._as_read(np.concatenate([position, links], axis=2), model, windows)
        out[1:, ..., :joints] = torque
        if links.size:
            _zero_links(out[0], windows, joints)

    def _as_read(self, position: Array, model: Model, windows: Windows) -> Array:
        """Return the positions (S, K segment, M) as old as the log reads them."""
        delay = model.constants.get("reading_delay", np.zeros(1))
        if not delay.any():
            return position
        parts = position.reshape(len(windows), windows.segments, windows.segment, -1)
        speed = np.gradient(parts, self.recording.step, axis=2).reshape(position.shape)
        return np.asarray(position - delay * speed)

    def _play(
        self,
        windows: Windows,
        past: int,
        correction: Array,
        memory: Array,
        paths: Array,
        rows: NDArray[np.int64],
        signals: Array,
        pool: ThreadPoolExecutor | None,
    ) -> None:
        count, fine = len(windows), windows.substeps
        both = np.concatenate([windows.commands, np.repeat(windows.held, fine, axis=1)], axis=2)
        commands = np.ascontiguousarray(both[:, windows.history * fine - past :])
        lengths, segment = np.full(count, signals.shape[1]), windows.segment * fine
        starts = (windows.position, windows.speed, windows.initial_state, np.tile(correction, (count, 1)))
        given = (commands, np.arange(count), lengths, past, 1, segment, *starts, memory, paths, rows)

        def run(first: int, last: int) -> None:
            self.plant.kernel.segments_batch(*given, first, last, signals)

        if pool is None:
            run(0, count)
        else:
            parts = [count * k // self.workers for k in range(self.workers + 1)]
            list(pool.map(run, parts[:-1], parts[1:]))

    def _past(self, model: Model, windows: Windows) -> int:
        """Return the steps before a window that its effects on the command remember."""
        longest = windows.history * windows.substeps
        effects = [term.effect for term in model.terms if term.effect.stage is Stage.COMMAND]
        return max((min(e.kept(self.plant.dt), longest) if e.bounded_memory else longest for e in effects), default=0)

    def _memories(self, model: Model, windows: Windows) -> Array:
        """Return one memory block for each window (S, size), reset to the window's start."""
        single = self.memory(model)
        memory = np.tile(single, (len(windows), 1))
        offsets = np.array([model.offsets[int(k)] for k in windows.initialisation])
        self.plant.view(memory, "offset")[:, 0] += self.tree.ratio * offsets[:, self.tree.follow]
        self.plant.view(memory, "angle_offset")[:] = offsets
        self.plant.reset(memory, self._links(model, windows), windows.speed[:, 0])
        self.plant.view(memory, "step")[:, 0] = (windows.begun + windows.time) / self.plant.dt
        self.plant.view(memory, "unsure")[:] = SMOOTHING * self.time
        self.plant.view(memory, "reading")[:] = 0  # a row is read as its first step begins
        for k, key in enumerate(("kp", "kd", "torque_limit")):
            self.plant.view(memory, key)[:] *= windows.gains[:, k]
        self.plant.view(memory, "brake")[windows.clamped] = CLAMPED
        for k, force in enumerate(windows.forces):
            if force is not None:
                measured = windows.measured[k, :, : len(self.recording.joints)]
                resting = np.average(measured, axis=0, weights=windows.weight[k, :, 0])
                self.plant.view(memory, "external_torque")[k] = force_torque(self.tree, force, resting)
        wind_up(self.plant, model, windows, memory)
        self.plant.view(memory, f"state:{PreslidingFriction.name}")[..., 1] = windows.balanced
        return memory

    def _jump_ratios(self, memory: Array, windows: Windows) -> tuple[Array, Array]:
        """Return the immediate response of the sensors to a jump of the command, see `jump_ratio`, (S, 1, n) each."""
        first = windows.commands[:, windows.history * windows.substeps]
        _, chosen, which = np.unique(windows.gains, axis=0, return_index=True, return_inverse=True)
        found = np.array([read_out.jump_ratio(self.plant, memory[k], first[k]) for k in chosen])[which.ravel(), :, None]
        return found[:, 0], found[:, 1]

    def _links(self, model: Model, windows: Windows) -> Array:
        """Return link positions (S, n) near the first row: measured less the motor's lead at the first torque."""
        constants = model.constants
        error = windows.commands[:, windows.history * windows.substeps] - windows.position[:, 0]
        torque = constants["kp"] * error - constants["kd"] * windows.speed[:, 0]
        limit = constants["torque_limit"]
        torque = np.clip(torque, -limit, limit)
        links = windows.position[:, 0] - torque / constants["stiffness"]
        for term in model.terms:
            if term.effect is Backlash and term.values.get("smooth", 0.0) > 0.0:
                j = self.recording.joints.index(term.joint)
                links[:, j] -= smooth_lead(torque[:, j], term.values["smooth"], term.values["softness"])
        return links


def sensors(recording: Recording) -> tuple[Array, Array]:
    """Return the position sensors' noise (n,) [rad], and how well a trial's initial speed is to be read [rad/s]."""
    return np.maximum(sensor_noise(recording), LEAST), START_SPEED * np.array(
        [one.of("rad/s") for one in joint_scales(recording)]
    )


def _zero_links(shown: Array, windows: Windows, joints: int) -> None:
    """Shift what sensors on links show (S, K segment, M): their zero is unknown.

    In each trial the mean of what a link is ahead of its motor becomes the measured one.
    """
    motors = windows.joint_of[joints:]
    ahead = (windows.measured - shown)[..., joints:] - (windows.measured - shown)[..., motors]
    known = np.where(windows.weight[..., joints:] > 0.0, ahead, np.nan)
    for trial in np.unique(windows.trial):
        own = windows.trial == trial
        for k in range(len(motors)):
            if np.isfinite(part := known[own, :, k]).any():
                shown[own, :, joints + k] += np.nanmean(part)


def force_torque(tree: RigidBodyTree, force: KnownForce, position: Array) -> Array:
    """Return torques (joints,) [N m] that a force on a link puts on the actuated joints at `position` (joints,) [rad].

    Raises:
        InputError: the force names a joint that the rig does not have.
    """
    if force.joint not in tree.dof_names:
        raise InputError(f"trials: key 'force.joint': '{force.joint}' is not a joint of the rig {list(tree.dof_names)}")
    # minus what it takes to hold a unit mass at that point where gravity is the force
    mass, com = np.zeros(tree.dofs), np.tile(force.point, (tree.dofs, 1))
    mass[tree.dof_names.index(force.joint)] = 1.0
    point = replace(tree, mass=mass, com=com, inertia=np.zeros_like(tree.inertia))
    _, held = point.equations(tree.expand(position), np.zeros(tree.dofs), np.asarray(force.vector))
    return np.asarray(-tree.coupling.T @ held)


def integrating_joints(model: Model, joints: tuple[str, ...]) -> list[int]:
    """Return the joints whose controller integrates its error in a model."""
    return [joints.index(t.joint) for t in model.terms if t.effect is IntegralAction and t.values["ki"] > 0.0]


def wind_up(plant: Plant, model: Model, windows: Windows, memory: Array) -> None:
    """Give integrals in memory (S, size) the value that they have as each window begins.

    As a trial begins they balance the load, but for the `wound` of its windows; from there on the logged error counts.
    """
    joints = integrating_joints(model, plant.joint_names)
    if not joints:
        return
    count, later = len(windows), windows.time > 0.0
    state = plant.view(memory, f"state:{IntegralAction.name}")
    state[:, joints, 1] = windows.wound[:, joints]
    if not later.any():
        return
    position, command, speed = np.moveaxis(windows.trial_start[:, :, None], 1, 0).copy()
    begun, unmoved = memory.copy(), np.zeros((count, 2 * position.shape[2]))
    plant.reset(begun, position[:, 0], speed[:, 0])
    which, lengths, starts = np.arange(count), np.ones(count, dtype=np.int64), (position, speed, unmoved, unmoved)
    out, no_path = np.zeros((count, 1, 1, position.shape[2])), np.zeros((count, 1))
    rows = np.array([TORQUE])
    plant.kernel.segments_batch(command, which, lengths, 0, 1, 1, *starts, begun, no_path, rows, 0, count, out)
    balance = plant.view(begun, f"state:{IntegralAction.name}")[:, :, 1]
    values = {t.joint: t.values for t in model.terms if t.effect is IntegralAction}
    for j in joints:
        own = values[plant.joint_names[j]]
        for k in np.flatnonzero(later):
            start = balance[k, j] + windows.wound[k, j]
            errors = windows.errors[k][:, 0, j] - own.get("lag", 0.0) * windows.errors[k][:, 1, j]
            state[k, j, 1] = integrated(errors, start, own["ki"], own.get("limit", 0.0))
        state[later, j, 0] = 2.0


@compiled_once
def integrated(errors: Array, start: float, gain: float, limit: float) -> float:
    """Return the integral [N m] after errors (T,) [rad s], kept within a limit unless that is zero."""
    value = start
    for error in errors:
        value += gain * error
        if limit > 0.0:
            value = min(max(value, -limit), limit)
    return value
