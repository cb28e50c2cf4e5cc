"""Simulates many models at once, each through all windows of a recording, on all cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.signals import COMMAND, LEAD, MOTOR_POSITION
from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.windows import SMOOTHING, START_SPEED, Windows, cut, steps_per_row
from tactile_cube.identification.joint_scales import joint_scales, rigid_body
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.jump_ratio import gaps, jump_ratio
from tactile_cube.measurement.replay.known_force import force_torque
from tactile_cube.measurement.replay.read_out import free_way
from tactile_cube.measurement.replay.rig_replay import CLAMPED

Array = NDArray[np.float64]
POSITION_STEP, SPEED_STEP = 5e-4, 0.02  # [rad], [rad/s] of a finger: finite differences of a segment's start


class Shooting:
    """The drivetrain of a rig, with every effect that may be tried compiled in."""

    def __init__(self, recording: Recording, effects: Sequence[type[Effect]]) -> None:
        """Build the plant; its kernel is compiled once and kept on disk.

        Args:
            recording: rig, controller and sampling step.
            effects: classes that a model may use.
        """
        self.recording = recording
        self.tree = rigid_body(recording)
        self.scales = joint_scales(recording)
        self.sizes = dict(zip(recording.joints, self.scales, strict=True))
        dt = recording.step / steps_per_row(recording, self.time)
        self.plant = Plant([self.tree], dt=dt, effects=tuple(effects), joint_names=recording.joints)
        self.workers = min(4, len(os.sched_getaffinity(0)))

    def finer(self, times: int) -> Shooting:
        """The same in steps so many times as short, for windows that are made finer likewise."""
        fine = copy(self)
        fine.plant = Plant([self.tree], self.plant.dt / times, self.plant.effects, self.recording.joints)
        return fine

    @property
    def time(self) -> float:
        """What a second of a finger stands for [s]."""
        return self.scales[0].time

    @property
    def start_speed(self) -> Array:
        """How well the speed at a segment's start is known beforehand, (n,) [rad/s]."""
        return START_SPEED * self.per_joint("rad/s")

    def cut(
        self,
        recording: Recording,
        noise: Array,
        trials: Sequence[Trial] | None = None,
        segment: int | None = None,
    ) -> Windows:
        """The trials of a recording as windows of this machine's size, see `windows.cut`."""
        return cut(recording, noise, trials, segment, self.time, self.start_speed)

    def per_joint(self, unit: str) -> Array:
        """How many times larger numbers of a unit are than at a finger, (n,)."""
        return np.array([scales.of(unit) for scales in self.scales])

    def positions(self, models: Sequence[Model], windows: Windows) -> Array:
        """Measured positions that each model predicts, (models, S, K segment, n) [rad]."""
        return self._simulate(models, [windows] * len(models))

    def positions_from(self, model: Model, initial_states: Sequence[Array], windows: Windows) -> Array:
        """The same for one model from several `initial_state`s, (initial states, S, K segment, n) [rad]."""
        begun = [replace(windows, initial_state=one) for one in initial_states]
        return self._simulate([model] * len(begun), begun)

    def gaps(self, model: Model) -> Array:
        """Width of the gap in each joint's transmission (n,) [rad]."""
        return gaps(self.plant, self.memory(model))

    def start_sensitivity(self, model: Model, windows: Windows) -> Array:
        """D position / d start of each segment, (2 n, S, K segment, n): n start positions, then n start speeds."""
        joints = len(self.recording.joints)
        correction = np.diag([*(POSITION_STEP * self.per_joint("rad")), *(SPEED_STEP * self.per_joint("rad/s"))])
        count = 2 * joints + 1
        moved = self._simulate([model] * count, [windows] * count, np.vstack([correction, np.zeros(2 * joints)]))
        # a simulation that ran away has no slope; it would swamp those of all others
        most = self.per_joint("rad")
        change = np.clip(np.nan_to_num(moved[:-1] - moved[-1], nan=0.0), -most, most)
        return np.asarray(change / correction.max(axis=1)[:, None, None, None])

    def _simulate(self, models: Sequence[Model], windows: Sequence[Windows], corrections: Array | None = None) -> Array:
        """Each model through its windows, the start of each segment moved by the model's correction."""
        out = np.zeros((len(models), *windows[0].measured.shape))
        if corrections is None:
            corrections = np.zeros((len(models), 2 * len(self.recording.joints)))
        whole = len(models) - len(models) % self.workers  # a model a core; the last ones' windows go to all cores
        with ThreadPoolExecutor(self.workers) as pool:
            list(pool.map(self._one, models[:whole], windows[:whole], corrections, out))
            for k in range(whole, len(models)):
                self._one(models[k], windows[k], corrections[k], out[k], pool)
        return out

    def _one(
        self, model: Model, windows: Windows, correction: Array, out: Array, pool: ThreadPoolExecutor | None = None
    ) -> None:
        memory = self._memory(model, windows)
        count, fine = len(windows), windows.substeps
        felt, _ = jump_ratio(self.plant, memory[0], windows.commands[0, windows.history * fine])
        gap = gaps(self.plant, memory[0])
        rows = np.array([MOTOR_POSITION, COMMAND, *([LEAD] if gap.any() else [])])
        signals = np.zeros((count, out.shape[1] * fine, len(rows), out.shape[2]))

        def run(first: int, last: int) -> None:
            self.plant.kernel.segments_batch(
                windows.commands,
                np.arange(count),
                np.full(count, signals.shape[1]),
                windows.history * fine,
                1,
                windows.segment * fine,
                windows.position,
                windows.speed,
                windows.initial_state,
                np.tile(correction, (count, 1)),
                memory,
                rows,
                first,
                last,
                signals,
            )

        if pool is None:
            run(0, count)
        else:
            parts = [count * k // self.workers for k in range(self.workers + 1)]
            list(pool.map(run, parts[:-1], parts[1:]))
        jump = _jumps(signals[:, :, 1], windows)
        free = free_way(signals[:, ::fine, 2], jump, gap) if gap.any() else 0.0
        out[:] = signals[:, ::fine, 0] - free - felt * (jump - free)

    def _memory(self, model: Model, windows: Windows) -> Array:
        """One block (S, size) for each window, at rest at its start."""
        single = self.memory(model)
        memory = np.tile(single, (len(windows), 1))
        offsets = np.array([model.offsets[int(k)] for k in windows.initialisation])
        self.plant.view(memory, "offset")[:, 0] += self.tree.ratio * offsets[:, self.tree.follow]
        self.plant.view(memory, "angle_offset")[:] = offsets
        self.plant.reset(memory, self._links(model, windows), windows.speed[:, 0])
        self.plant.view(memory, "step")[:, 0] = windows.time / self.plant.dt
        self.plant.view(memory, "unsure")[:] = SMOOTHING * self.time
        for k, key in enumerate(("kp", "kd", "torque_limit")):
            self.plant.view(memory, key)[:] *= windows.gains[:, k]
        self.plant.view(memory, "brake")[windows.clamped] = CLAMPED
        for k, force in enumerate(windows.forces):
            if force is not None:
                resting = np.average(windows.measured[k], axis=0, weights=windows.weight[k, :, 0])
                self.plant.view(memory, "external_torque")[k] = force_torque(self.tree, force, resting)
        return memory

    def memory(self, model: Model) -> Array:
        """Memory (size,) of the plant with a model's constants and effects."""
        known = model.constants
        constants = DrivetrainConstants(
            kp=known["kp"],
            kd=known["kd"],
            stiffness=known["stiffness"],
            static_friction=known["static_friction"],
            reflected_inertia=known["reflected_inertia"],
            torque_limit=known["torque_limit"],
        )
        memory: Array = self.plant.memory(constants, gravity=self.recording.gravity)
        self.plant.view(memory, "friction_creep")[:] = model.constants["friction_creep"]
        self.plant.view(memory, "command_torque_limit")[:] = np.inf
        for term in model.terms:
            self.plant.set_effect(memory, term.effect, term.joint, term.values)
        return memory

    def _links(self, model: Model, windows: Windows) -> Array:
        """Link positions (S, n) near those of the first row: measured less the deflection of the plain drive."""
        constants = model.constants
        error = windows.commands[:, windows.history * windows.substeps] - windows.position[:, 0]
        torque = constants["kp"] * error - constants["kd"] * windows.speed[:, 0]
        limit = constants["torque_limit"]
        return windows.position[:, 0] - np.clip(torque, -limit, limit) / constants["stiffness"]


def _jumps(acting: Array, windows: Windows) -> Array:
    """Simulated command at each reading less the one that the log feels (S, K segment, n).

    Known exactly unless an effect changes the command on its way; then half the change across the reading, smoothed
    where a row is one step.
    """
    first, fine = windows.history * windows.substeps, windows.substeps
    if np.array_equal(acting, windows.commands[:, first:]):
        return windows.jump
    jumps = np.zeros_like(acting[:, ::fine])
    if fine == 1:
        jumps[:, 1:-1] = 0.25 * (acting[:, 2:] - acting[:, :-2])
    else:
        jumps[:, 1:] = 0.5 * (acting[:, fine + 1 :: fine] - acting[:, fine - 1 : -fine : fine])
    return jumps if windows.read_after else -jumps
