"""Multiple shooting: models through short segments of a recording, each started anew from what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.errors import InputError
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.replay.simulator import Path, Simulator
from tactile_cube.measurement.replay.windows import LONGEST_STEP, START_SPEED, Windows, cut

Array = NDArray[np.float64]
POSITION_STEP, SPEED_STEP = 5e-4, 0.02  # [rad], [rad/s] of a finger: finite differences of a segment's start


class Shooting(Simulator):
    """The simulator of a recording in steps, segments and differences of its machine's size."""

    def __init__(self, recording: Recording, effects: Sequence[type[Effect]]) -> None:
        """Build the plant.

        Args:
            recording: rig, controller and sampling step.
            effects: classes that a model may use, beside those of the catalogue.

        Raises:
            InputError: no joint moves.
        """
        if not any(np.ptp(trial.position, axis=0).any() for trial in recording.trials):
            raise InputError(f"{recording.folder}: no joint moves in any trial; record motion, or check the columns")
        self.scales = joint_scales(recording)
        self.sizes = dict(zip(recording.joints, self.scales, strict=True))
        time = self.scales[0].time
        super().__init__(recording, effects, LONGEST_STEP * time, time=time)

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

    def positions(self, models: Sequence[Model], windows: Windows, near: Path | None = None) -> Array:
        """Measured positions that each model predicts, (models, S, K segment, sensors) [rad]; `near` a path or not."""
        return self.simulate(models, [windows] * len(models), near=near)[:, 0]

    def positions_from(self, model: Model, initial_states: Sequence[Array], windows: Windows) -> Array:
        """The same for one model from several `initial_state`s, (initial states, S, K segment, sensors) [rad]."""
        begun = [replace(windows, initial_state=one) for one in initial_states]
        return self.simulate([model] * len(begun), begun)[:, 0]

    def start_sensitivity(self, model: Model, windows: Windows, path: Path | None = None) -> Array:
        """D position / d start of each segment, (2 n, S, K segment, sensors): by n positions, then n speeds.

        `path` is the model's own through these windows, if it is known.
        """
        path = path or self.path(model, windows)
        joints = len(self.recording.joints)
        correction = np.diag([*(POSITION_STEP * self.per_joint("rad")), *(SPEED_STEP * self.per_joint("rad/s"))])
        count = 2 * joints
        moved = self.simulate([model] * count, [windows] * count, correction, near=path)[:, 0]
        # a simulation that ran away has no slope; it would swamp those of all others
        most = self.per_joint("rad")[windows.joint_of]
        change = np.clip(np.nan_to_num(moved - path.position, nan=0.0), -most, most)
        return np.asarray(change / correction.max(axis=1)[:, None, None, None])
