"""Torque-driven pendulum with a direct drive: two swings that are let go, and two sines of torque, 500 Hz.

Source: github.com/lvjonok/mujoco-sysid, commit f22efa8, examples/pendulum/data.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

RATE = 500.0  # [Hz]
TRIALS = {"": ("free_fall_1", "harmonic_input_1", "harmonic_input_2"), "validation": ("free_fall_2",)}


@dataclass(frozen=True)
class PendulumTorque:
    """Imports pendulum_torque.npz and its owner's URDF; the commanded torque is the command.

    Attributes:
        folder: with both files.
    """

    folder: str

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Three trials to identify with, and a swing from another height to validate with."""
        archive = read_npz(Path(self.folder) / "pendulum_torque.npz")
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=["hinge"], controller={"mode": "torque"},
            sensors={"read": "before"}, source="lvjonok/mujoco-sysid, commit f22efa8",
        )  # fmt: skip
        urdf = (Path(self.folder) / "pendulum.urdf").read_text()
        return {
            part: RecordingTables(description, urdf, [self._trial(archive, name) for name in names])
            for part, names in TRIALS.items()
        }

    def _trial(self, archive: dict[str, np.ndarray], name: str) -> TrialTable:
        torque, position = (
            np.asarray(archive[f"{name}.{key}"], dtype=np.float64)[:, None] for key in ("torque", "position")
        )
        return TrialTable(
            TrialEntry(file=f"trials/{name}.parquet", kind=name), np.arange(len(torque)) / RATE, torque, position
        )
