"""Little finger of a Shadow Dexterous Hand: open-loop runs of one tendon-driven joint that repeats poorly.

Source: github.com/rtkg/motion_primitives (BSD), Krug, AASS Oerebro, 2012.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

EFFORT = 1e-3  # [N m] taken for one unit of effort: the true scale is unknown, all torques and inertias share it
RATE = 1000.0  # [Hz]
TRAINED_ON = ("sweep_10p0_120at45deg_0p5_5p0", "sweep_10p0_150at45deg_0p5_5p0")
HELD_OUT = ("sweep_10p0_180at45deg_0p5_5p0", "sweep_10p0_100at45deg_0p5_5p0")
NOMINAL = {"static_friction": 0.05, "reflected_inertia": 1.5e-3}  # [N m], [kg m^2] in the scale above, guesses


@dataclass(frozen=True)
class ShadowLfj3:
    """Imports lfj3_openloop.npz.

    Attributes:
        file: path of the archive.
        segment: length of a trial [s]: the sweeps are cut, because an open loop drifts away; null: whole sweeps.
    """

    file: str
    segment: float | None = 0.4

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Sweeps of 120 and 150 to identify with, of 180 and 100 held out, as in the data set's reference figures."""
        archive = read_npz(Path(self.file))
        columns = [str(name) for name in archive.pop("columns")]
        description = described(
            gravity=[0.0, 0.0, 0.0], rate_hz=RATE, joints=["LFJ3"], controller={"mode": "torque"}, nominal=NOMINAL,
            source="rtkg/motion_primitives (BSD); effort commands a tendon-force loop; 1 unit is taken for 1 mN m",
        )  # fmt: skip
        urdf = single_joint_urdf("shadow_lfj3", "LFJ3", 0.0, 0.0, 1e-6, limit=1.7)
        runs = {"": TRAINED_ON, "validation": HELD_OUT}
        return {
            name: RecordingTables(
                description, urdf, [t for run in members for t in self._cut(run, columns, archive[run])]
            )
            for name, members in runs.items()
        }

    def _cut(self, run: str, columns: list[str], data: np.ndarray) -> list[TrialTable]:
        log = dict(zip(columns, data.astype(np.float64).T, strict=True))
        samples = len(data) if self.segment is None else round(self.segment * RATE)
        tables = []
        for number, start in enumerate(range(0, len(data) - samples + 1, samples)):
            part = slice(start, start + samples)
            time = log["t_s"][part] - log["t_s"][start]
            entry = TrialEntry(file=f"trials/{run}_{number:02d}.parquet", kind=run)
            command = EFFORT * log["effort_cmd"][part, None]
            tables.append(TrialTable(entry, time, command, log["q_rad"][part, None]))
        return tables
