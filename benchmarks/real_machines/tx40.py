"""Industrial arm (Staubli TX40, 6 joints): motor signals and positions of one motion, no command.

Source: github.com/thanhndv212/figaroh-examples, examples/staubli_TX40 (Apache-2.0).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

Array = NDArray[np.float64]
LOGGED = 5000.0  # [Hz]
CUTOFF, DECIMATION = 100.0, 10  # [Hz], samples: as the publishers treat the log
JOINTS = [f"joint_{k}" for k in range(1, 7)]
REDUCTION = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])  # motor over joint angle
REDUCTION[5, 4] = 32.0  # joint 6's motor moves with joint 5
ROTOR = [0.36, 0.36, 0.099, 0.031, 0.047, 0.0105]  # [kg m^2] at the joint, as published
SHARE = 0.6  # first part to identify with


@dataclass(frozen=True)
class Tx40:
    """Imports tx40.npz; one unit of motor signal is taken for 1 N m at the motor, its true scale is unknown.

    Attributes:
        folder: with tx40.npz and tx40.urdf.
        length: of a trial [s]: an arm that is simulated openly drifts away.
    """

    folder: str
    length: float = 0.3

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The first 60 % of the motion, and under `validation` the rest."""
        archive = read_npz(Path(self.folder) / "tx40.npz")
        motor = smoothed(np.radians(archive["position_deg"]) * np.abs(np.diag(REDUCTION)))
        position = motor @ np.linalg.inv(REDUCTION).T
        torque = smoothed(archive["motor_current_signal"]) @ REDUCTION
        entry = TrialEntry(file="trials/motion.parquet", kind="motion")
        time = np.arange(len(position)) * DECIMATION / LOGGED
        pieces = list(cut_trial(TrialTable(entry, time, torque, position), self.length))
        first = round(SHARE * len(pieces))
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=LOGGED / DECIMATION, joints=JOINTS, controller={"mode": "torque"},
            nominal={"reflected_inertia": ROTOR}, sensors={"read": "before"},
            source="figaroh-examples staubli_TX40 (Apache-2.0), filtered at 100 Hz; 1 unit is 1 N m at the motor",
        )  # fmt: skip
        urdf = read_rig(Path(self.folder) / "tx40.urdf").text
        parts = {"": pieces[:first], "validation": pieces[first:]}
        return {name: RecordingTables(description, urdf, tables) for name, tables in parts.items()}


def smoothed(values: Array) -> Array:
    """Samples (n, joints) without what is faster than 100 Hz, every tenth of them; no delay."""
    low_pass = signal.butter(4, CUTOFF, fs=LOGGED, output="sos")
    return np.asarray(signal.sosfiltfilt(low_pass, values, axis=0)[::DECIMATION])
