"""Quasi-direct-drive pendulum (T-Motor AK80-6): runs of several controllers, another weight, pushes by hand.

Source: github.com/dfki-ric-underactuated-lab/torque_limited_simple_pendulum (BSD-3-Clause); Wiebe et al., JOSS 2022.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

MASS, LENGTH = 0.676, 0.45  # [kg], [m] of weight, rod and mounting together
INERTIA = 0.0096  # [kg m^2] about their centre: 0.546 kg at 0.5 m beside a rod of 0.13 kg
ROTOR = 6.07e-5 * 6**2  # [kg m^2] behind the gear
RATE = 200.0  # [Hz]
RESOLUTION = 2 * np.pi / 4096  # [rad]
RUNS = {
    "": ("energy_shaping", "pd_swingup", "ddp", "direct_collocation"),
    "validation": ("sac",),
    "heavier": ("energy_shaping_1kg",),
}
PUSHED_FROM = {"pd_swingup": 4.0, "energy_shaping": 7.0, "energy_shaping_1kg": 12.0, "sac": 7.0}  # [s]


@dataclass(frozen=True)
class DfkiPendulum:
    """Imports dfki_pendulum.npz.

    The controllers fed the measured state back, so the logged command is not what moved the rig; the torque that the
    motor driver reports is, and stands for the command.

    Attributes:
        file: path of the archive.
        length: of a trial [s]; a pendulum that is simulated openly for longer tips over another way.
    """

    file: str
    length: float = 1.0

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Runs to identify with, a run held out, and under `heavier` a run with another weight than the one stated."""
        archive = read_npz(Path(self.file))
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=["pendulum"], controller={"mode": "torque"},
            nominal={"reflected_inertia": ROTOR}, sensors={"read": "before", "position_resolution": RESOLUTION},
            source="dfki-ric-underactuated-lab/torque_limited_simple_pendulum (BSD-3-Clause), measured torque",
        )  # fmt: skip
        urdf = single_joint_urdf("dfki_pendulum", "pendulum", MASS, LENGTH, INERTIA, limit=100.0)
        return {
            name: RecordingTables(
                description, urdf, [piece for run in runs for piece in self._trials(run, archive[f"{run}/measured"])]
            )
            for name, runs in RUNS.items()
        }

    def _trials(self, run: str, data: np.ndarray) -> list[TrialTable]:
        """Pieces of a run; those in which somebody pushes are marked as excluded."""
        time = np.arange(0.0, data[-1, 0] - data[0, 0], 1 / RATE)
        signals = [np.interp(time, data[:, 0] - data[0, 0], data[:, column])[:, None] for column in (3, 1)]
        entry = TrialEntry(file=f"trials/{run}.parquet", kind=run)
        pieces = cut_trial(TrialTable(entry, time, *signals), self.length)
        pushed = PUSHED_FROM.get(run, np.inf)
        return [self._marked(piece, number * self.length + self.length > pushed) for number, piece in enumerate(pieces)]

    def _marked(self, piece: TrialTable, pushed: bool) -> TrialTable:
        if pushed:
            piece.entry.exclude = [(0.0, float(piece.time[-1]) + 1 / RATE)]
            piece.entry.note = "pushed by hand"
        return piece
