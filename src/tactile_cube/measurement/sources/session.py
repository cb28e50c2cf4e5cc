"""A bench session: a simulated rig with its true constants, and the sensors that log it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_cube.measurement.excitation import excitation, safe_range
from tactile_cube.measurement.recordings.description import Description, Touch, TrialEntry, per_joint
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import Rig
from tactile_cube.measurement.recordings.trial import Gains, Trial
from tactile_cube.measurement.recordings.writing import TrialTable
from tactile_cube.measurement.replay.model import Model, Term, terms_of
from tactile_cube.measurement.replay.simulator import Simulated, Simulator

Array = NDArray[np.float64]
OBSTACLE = 500.0  # [N m/rad] stiffness of what a link touches
SETTLING = 1.0  # [s] at the first command before a trial is logged


class LogSensors(Protocol):
    """What a log's sensors get wrong."""

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        ...

    @property
    def noise(self) -> float:
        """Standard deviation of the position [rad]."""
        ...

    @property
    def resolution(self) -> float:
        """Of the position [rad]; 0 for none."""
        ...

    @property
    def torque_noise(self) -> float:
        """Standard deviation of the torque [N m]."""
        ...


def logged(
    entry: TrialEntry, command: Array, result: Simulated, sensors: LogSensors, rng: np.random.Generator
) -> TrialTable:
    """A simulated trial, (n, joints) each, as the sensors log it."""
    position = result.position + rng.normal(0, sensors.noise, command.shape)
    if sensors.resolution > 0:
        position = np.round(position / sensors.resolution) * sensors.resolution
    torque = result.torque + rng.normal(0, sensors.torque_noise, command.shape)
    return TrialTable(entry, np.arange(len(command)) / sensors.rate, command, position, torque)


@dataclass(frozen=True)
class FreeSession:
    """Plays trials of a rig that holds nothing.

    Attributes:
        sensors: that log it.
        simulator: the rig.
        constants: the true ones of the drivetrain, key -> (joints,).
        effects: hidden ones, with their values.
        rng: noise.
    """

    sensors: LogSensors
    simulator: Simulator
    constants: dict[str, Array]
    effects: tuple[Term, ...]
    rng: np.random.Generator

    def play(self, entry: TrialEntry, command: Array, offset: Array) -> TrialTable:
        """Simulate one trial, settled at its first command before, and log it."""
        settle = round(SETTLING * self.sensors.rate)
        recording = self.simulator.recording
        trial = _silent_trial(np.pad(command, ((settle, 0), (0, 0)), mode="edge"), recording, entry)
        touched = terms_of([] if entry.touch is None else [_obstacle(entry.touch)], recording.joints)
        model = Model(self.constants, (*self.effects, *touched), {trial.initialisation: -offset})
        ((result,),) = self.simulator.free_runs([model], [trial])
        if entry.force is not None:  # a force pulls at the posture that it leads to
            trial = replace(trial, position=result.position)
            ((result,),) = self.simulator.free_runs([model], [trial])
        seen = Simulated(result.position[settle:], result.torque[settle:])
        return logged(entry, command, seen, self.sensors, self.rng)


def free_command(
    kind: str, rig: Rig, joints: list[str], reach: float, duration: float, rate: float, rng: np.random.Generator
) -> Array:
    """Commands (duration * rate, joints) [rad] of free motion within the middle `reach` of each joint's range."""
    ranges = np.array([safe_range(rig.joints[joint], reach) for joint in joints])
    return excitation(kind, ranges[:, 0], ranges[:, 1], duration, rate, rng)


def true_constants(
    stated: Mapping[str, float], joints: tuple[str, ...], spread: float, rng: np.random.Generator
) -> dict[str, Array]:
    """Gains as stated; damping, friction and inertia differ from what is believed by up to `spread`, joint by joint."""
    constants = {key: per_joint(value, joints, key) for key, value in stated.items()}
    for key in ("kd", "static_friction", "reflected_inertia"):
        constants[key] = constants[key] * rng.uniform(1 - spread, 1 + spread, len(joints))
    return constants


def unmeasured(description: Description, rig: Rig, constants: dict[str, Array]) -> Recording:
    """The rig as a recording without trials, as the simulators want it."""
    gains = Gains(constants["kp"], constants["kd"], constants["torque_limit"])
    return Recording(Path(), description, rig, gains, {}, ())


def _obstacle(touch: Touch) -> tuple[str, dict[str, float]]:
    """A hard stop where the touching joint meets the obstacle."""
    return f"joint_stop@{touch.joint}", {"upper": touch.angle, "stiffness": OBSTACLE, "damping": 0.5}


def _silent_trial(command: Array, rig: Recording, entry: TrialEntry) -> Trial:
    """A trial that starts at rest at its first command."""
    time = np.arange(len(command)) / rig.rate
    still = np.broadcast_to(command[0], command.shape)
    valid = np.ones(len(command), dtype=bool)
    torque = np.zeros_like(command)
    return Trial(entry.kind, entry.file, entry.kind, entry.initialisation, time, command, still, torque, valid,
                 rig.gains, entry.force, entry.clamped)  # fmt: skip
