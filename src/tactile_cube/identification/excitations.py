"""Commands of many kinds that a machine may be asked to follow next."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.command_limits import limits_of
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
DURATION = 12.0  # [s] of a finger
FASTEST = 1.5  # times the fastest command of the recording: known to be safe, with a little more
DRIVEN = 0.9  # part of a command that drives, where commands are torques: then it rests, and the joint comes to a stop


def excitations(recording: Recording, seed: int, unit: float = 1.0) -> dict[str, Array]:
    """Commands (T, n) of each kind, inside those of the recording and near their speed.

    Torques begin with a push away from the nearer end of the range and swing like a cosine, so that the way that they
    drive a free mass has an end; at last they rest, until friction has stopped it.

    Args:
        recording: what has been played so far.
        seed: of phases and postures.
        unit: what a second of a finger stands for [s].
    """
    everything, middle = _commands(recording), middle_command(recording)
    half = np.maximum(np.minimum(everything.max(axis=0) - middle, middle - everything.min(axis=0)), 0.0)
    fastest = np.max([np.abs(np.diff(trial.command, axis=0)).max(axis=0) for trial in recording.trials], axis=0)
    time: Array = np.arange(round(DURATION * unit / recording.step), dtype=np.float64) * recording.step / unit
    waves = _waves(time, recording, np.random.default_rng(seed))
    if recording.torque_controlled:
        driven = (time > 0.0) & (time < DRIVEN * time[-1])
        waves = {kind: wave * driven[:, None] for kind, wave in waves.items()}
    return {kind: _limited(middle + half * wave, FASTEST * fastest) for kind, wave in waves.items()}


def middle_command(recording: Recording) -> Array:
    """The command (n,) about which to move: mid-range, or the torque that carries the links where they begin."""
    if not recording.torque_controlled:
        everything = _commands(recording)
        return np.asarray(0.5 * (everything.min(axis=0) + everything.max(axis=0)))
    tree = recording.rigid_body()
    posture, still = tree.expand(recording.trials[-1].position[0]), np.zeros(tree.dofs)
    return np.asarray(tree.coupling.T @ tree.equations(posture, still, recording.gravity)[1])


def _waves(time: Array, recording: Recording, rng: np.random.Generator) -> dict[str, Array]:
    joints, time = len(recording.joints), time[:, None]
    phases = rng.uniform(0.0, 2.0 * np.pi, joints)
    if recording.torque_controlled:
        phases = 0.5 * np.pi * _first_push(recording)
    turns, growing = phases / (2.0 * np.pi), time / time[-1]
    return {
        "slow triangles": _triangle(time / 6.0 + turns),
        "fast triangles": _triangle(time / 1.0 + turns),
        "growing triangles": growing**2 * _triangle(time / 1.5 + turns),
        "tiny triangles": 0.05 * _triangle(time / 2.0 + turns),
        "growing steps": (0.1 + 0.9 * growing) * np.sign(np.sin(2 * np.pi * time / 1.6 + phases)),
        "rising frequency": 0.4 * np.sin(2 * np.pi * (0.2 * time + 0.3 * time**2) + phases),
        "holds with small moves": _holds(time[:, 0], joints, rng),
    }


def _first_push(recording: Recording) -> Array:
    """Direction (n,) away from that end of its range at which a joint begins."""
    limits, start = limits_of(recording).largest, recording.trials[-1].position[0]
    return np.where(start < 0.5 * (limits.low + limits.high), 1.0, -1.0)


def _commands(recording: Recording) -> Array:
    return np.concatenate([trial.command for trial in recording.trials])


def _triangle(turns: Array) -> Array:
    """A triangle with the signs and peaks of a sine."""
    turns = turns - 0.25
    return np.asarray(1.0 - 4.0 * np.abs(turns - np.floor(turns + 0.5)))


def _holds(time: Array, joints: int, rng: np.random.Generator) -> Array:
    steps = rng.uniform(-0.9, 0.9, (round(time[-1]) + 1, joints))
    return np.asarray(steps[np.minimum(time.astype(int), len(steps) - 1)])


def _limited(command: Array, most: float) -> Array:
    """Commands whose change from row to row stays within what is safe."""
    safe = command.copy()
    for k in range(1, len(safe)):
        safe[k] = safe[k - 1] + np.clip(command[k] - safe[k - 1], -most, most)
    return safe
