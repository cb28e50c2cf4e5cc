"""LeRobot SO-101 servo arm: named experiments at 50 Hz, with 19 repeats of one motion.

Source: github.com/isaac-sim2real/sage (Apache-2.0), output/real/so101.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

Array = NDArray[np.float64]
RATE = 50.0  # [Hz]
CONTROLLER = {"kp": 17.8, "kd": 0.6, "torque_limit": 3.35}  # STS3215 in MuJoCo Menagerie's SO-ARM100, from BAM's fit
NOMINAL = {"static_friction": 0.052, "reflected_inertia": 0.028}  # the same source
REPEATED = "repetitive_motion"


@dataclass(frozen=True)
class So101Sage:
    """Imports one joint of some of the arm's motions.

    The arm's masses are not part of the data set: the joint is described with its drive alone. That fits the joints
    that carry no weight, the rotation about the vertical and the roll of the wrist.

    Attributes:
        folder: where the NPZ files lie.
        joint: Rotation, Pitch, Elbow, Wrist_Pitch, Wrist_Roll or Jaw.
        motions: names of files; `repetitive_motion` is cut into its cycles.
        share: the first part of each motion is to identify with, the rest is held out.
        length: longest trial [s].
    """

    folder: str
    joint: str = "Wrist_Roll"
    motions: Iterable[str] = ("backlash_detection",)
    share: float = 0.6
    length: float = 12.0

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The first part of each motion, and under `validation` the rest."""
        parts: dict[str, list[TrialTable]] = {"": [], "validation": []}
        for motion in self.motions:
            archive = read_npz(Path(self.folder) / f"{motion}.npz")
            time, command, position = self._signals(archive)
            length = _period(command) if motion == REPEATED else round(self.length * RATE)
            starts = list(range(0, len(time) - length + 1, length))
            for number, start in enumerate(starts):
                piece = slice(start, start + length)
                entry = TrialEntry(file=f"trials/{motion}_{number:02d}.parquet", kind=motion)
                table = TrialTable(entry, time[piece] - time[start], command[piece], position[piece])
                parts["" if number < self.share * len(starts) else "validation"].append(table)
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=[self.joint], controller=CONTROLLER, nominal=NOMINAL,
            sensors={"read": "before", "position_resolution": 2 * np.pi / 4096},
            source="isaac-sim2real/sage so101 (Apache-2.0); drive constants of MuJoCo Menagerie's SO-ARM100",
        )  # fmt: skip
        urdf = single_joint_urdf("so101", self.joint, 0.05, 0.0, 2e-4, axis="0 0 1")
        return {name: RecordingTables(description, urdf, tables) for name, tables in parts.items() if tables}

    def _signals(self, archive: dict[str, NDArray[np.generic]]) -> tuple[Array, Array, Array]:
        joints = [str(name) for name in archive["joints"]]
        if self.joint not in joints:
            raise InputError(f"source.joint={self.joint}: unknown; the arm has {', '.join(joints)}")
        index = joints.index(self.joint)
        command, position = archive["cmd"][:, [index]], archive["q"][:, [index]]
        return archive["t"].astype(np.float64), command.astype(np.float64), position.astype(np.float64)


def _period(command: Array) -> int:
    """Samples after which the command repeats itself best, from 2 s on."""
    signal = command[:, 0] - command[:, 0].mean()
    longest = len(signal) // 3
    differences = [np.mean((signal[lag:] - signal[:-lag]) ** 2) for lag in range(round(2 * RATE), longest)]
    best = min(differences) + 0.02 * float(np.var(signal))
    return round(2 * RATE) + int(np.argmax(np.array(differences) <= best))
