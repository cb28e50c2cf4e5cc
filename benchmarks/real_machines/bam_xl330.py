"""Dynamixel XL330 on a pendulum bench: 16 logs of Rhoban's BAM, a real servo of a finger's size.

Source: github.com/Rhoban/bam, branch xl330 (Apache-2.0); Duclusaud et al., ICRA 2025, arXiv 2410.08650.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.measurement.recordings.description import ControllerChange, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

MASS, LENGTH = 0.49, 0.10  # [kg], [m] of the pendulum
STALL_TORQUE = (
    0.75  # [N m] at the nominal 7.4 V, extrapolated from the data sheet's 0.52 N m at 5 V and 0.60 N m at 6 V
)
NO_LOAD_SPEED = 13.5  # [rad/s] at 7.4 V, from 104 rpm at 6 V
DUTY_PER_GAIN = 4096 / (2 * np.pi) / (256 * 885)  # duty of one firmware gain at one radian of error
REFLECTED_INERTIA = 0.002  # [kg m^2] a guess
RATE = 200.0  # [Hz] a little above the logs' 3.5 .. 5.3 ms
HELD_OUT = 200  # firmware gain whose logs are the validation recording


@dataclass(frozen=True)
class BamXl330:
    """Imports xl330.npz.

    Attributes:
        file: path of the archive.
    """

    file: str

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Gains 100, 400 and 800 to identify with; gain 200 is held out."""
        archive = read_npz(Path(self.file))
        columns = [str(name) for name in archive.pop("columns")]
        urdf = single_joint_urdf("xl330", "servo", MASS, LENGTH)
        parts: dict[str, list[TrialTable]] = {"": [], "validation": []}
        for name, data in archive.items():
            motion, _, gain = name.rpartition("_kp")
            log = dict(zip(columns, data.astype(np.float64).T, strict=True))
            parts["validation" if int(gain) == HELD_OUT else ""].append(_trial(motion, int(gain), log))
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=["servo"],
            controller={"kp": stiffness(HELD_OUT), "kd": STALL_TORQUE / NO_LOAD_SPEED, "torque_limit": STALL_TORQUE},
            nominal={"static_friction": 0.01, "reflected_inertia": REFLECTED_INERTIA},
            sensors={"read": "before", "position_resolution": 2 * np.pi / 4096},
            source="Rhoban/bam xl330 (Apache-2.0); kp = gain x stall torque, kd = back-EMF, from the data sheet",
        )  # fmt: skip
        return {name: RecordingTables(description, urdf, tables) for name, tables in parts.items()}


def stiffness(gain: int) -> float:
    """Joint stiffness [N m/rad] of a firmware P gain: duty times stall torque."""
    return float(gain * DUTY_PER_GAIN * STALL_TORQUE)


def _trial(motion: str, gain: int, log: dict[str, np.ndarray]) -> TrialTable:
    """One log, up to the moment where the servo is switched off."""
    off = np.flatnonzero(log["torque_enable"] < 0.5)
    end = int(off[0]) if len(off) else len(log["t_s"])
    controller = ControllerChange(kp=stiffness(gain))
    entry = TrialEntry(file=f"trials/{motion}_{gain}.parquet", kind=motion, controller=controller)
    return TrialTable(entry, log["t_s"][:end], log["goal_rad"][:end, None], log["q_rad"][:end, None])
