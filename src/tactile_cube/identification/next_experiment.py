"""The commands that would tell rival explanations apart: simulated under every rival, the most telling written down."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from tactile_cube.identification.fitting.model import Model
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.fitting.windows import cut
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial

Array = NDArray[np.float64]
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
        difference: smallest RMS difference between two rivals [rad].
        joint: where the rivals differ most.
        predictions: rival -> (T, n) [rad].
    """

    name: str
    joints: tuple[str, ...]
    time: Array
    commands: Array
    difference: float
    joint: str
    predictions: dict[str, Array]

    def write(self, folder: Path) -> Path:
        """next_experiment.csv: time and the commands, in the columns of a recording."""
        columns = {"time": self.time}
        columns |= {f"{name}.command": self.commands[:, j] for j, name in enumerate(self.joints)}
        path = folder / "next_experiment.csv"
        pl.DataFrame(columns).write_csv(path, float_precision=8)
        return path


def next_experiment(
    shooting: Shooting, recording: Recording, rivals: dict[str, Model], noise: Array, seed: int = 0
) -> Experiment:
    """The excitation whose worst-told pair of rivals differs most, in units of the noise."""
    excitations = safe_excitations(recording, seed, shooting.time)
    trials = [_trial(recording, name, commands) for name, commands in excitations.items()]
    windows = [cut(recording, noise, [trial], segment=len(trial.time), time=shooting.time) for trial in trials]
    models = [_without_offsets(model) for model in rivals.values()]
    best: Experiment | None = None
    for trial, window in zip(trials, windows, strict=True):
        predicted = shooting.positions(models, window)[:, 0]
        pairs = [(a, b) for a in range(len(models)) for b in range(a)]
        distances = np.array([np.sqrt(np.mean((predicted[a] - predicted[b]) ** 2, axis=0)) for a, b in pairs])
        worst = distances[np.argmin(distances.max(axis=1))]
        if best is None or worst.max() > best.difference:
            joint = recording.joints[int(np.argmax(worst))]
            shown = dict(zip(rivals, predicted, strict=True))
            best = Experiment(trial.kind, recording.joints, trial.time, trial.command, float(worst.max()), joint, shown)
    assert best is not None
    return best


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


def _trial(recording: Recording, name: str, commands: Array) -> Trial:
    time: Array = np.arange(len(commands), dtype=np.float64) * recording.step
    valid = np.ones(len(time), dtype=bool)
    return Trial(name, "", name, 0, time, commands, commands.copy(), None, valid, recording.gains)


def _without_offsets(model: Model) -> Model:
    zero = {0: np.zeros_like(next(iter(model.offsets.values())))}
    return Model(model.constants, model.terms, zero)
