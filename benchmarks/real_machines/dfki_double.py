"""Double pendulum with two quasi-direct drives (T-Motor AK80-6), torques measured, 500 Hz, five logs.

Source: github.com/dfki-ric-underactuated-lab/double_pendulum (BSD-3-Clause), design C.1, model 1.0.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

RATE = 500.0  # [Hz]
MASSES, LENGTHS, CENTRES = (0.5235, 0.6256), (0.2, 0.3), (0.2, 0.2557)  # [kg], [m], [m]
INERTIAS = (0.03189, 0.05087)  # [kg m^2] about each joint
ROTOR = 6.29e-5 * 6**2  # [kg m^2] behind the gear
RESOLUTION = 2 * np.pi / 4096 / 6  # [rad]
VALIDATION = "20230629-143704"  # driven at the second joint alone


def _link(number: int) -> str:
    mass, centre = MASSES[number], CENTRES[number]
    about_centre = INERTIAS[number] - mass * centre**2
    return f"""<link name="link_{number + 1}"><inertial><origin xyz="0 0 {-centre}"/><mass value="{mass}"/>
<inertia ixx="{about_centre:.6g}" iyy="{about_centre:.6g}" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


URDF = f"""<?xml version="1.0"?>
<robot name="dfki_double">
<link name="base"/>
{_link(0)}
{_link(1)}
<joint name="joint_1" type="revolute"><parent link="base"/><child link="link_1"/><axis xyz="0 1 0"/>
<limit lower="-7" upper="7" effort="12" velocity="40"/></joint>
<joint name="joint_2" type="revolute"><parent link="link_1"/><child link="link_2"/><origin xyz="0 0 {-LENGTHS[0]}"/>
<axis xyz="0 1 0"/><limit lower="-7" upper="7" effort="12" velocity="40"/></joint>
</robot>
"""


@dataclass(frozen=True)
class DfkiDouble:
    """Imports the logs; the torque that the motor drivers report stands for the command, as the controllers feed back.

    Attributes:
        folder: with the logs, one NPZ file each.
        length: of a trial [s]; a double pendulum that is simulated openly for longer goes its own way.
    """

    folder: str
    length: float = 1.0

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Four logs to identify with, and the one that another joint drives to validate with."""
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=["joint_1", "joint_2"], controller={"mode": "torque"},
            nominal={"reflected_inertia": ROTOR}, sensors={"read": "before", "position_resolution": RESOLUTION},
            source="dfki-ric-underactuated-lab/double_pendulum (BSD-3-Clause), design C.1, measured torque",
        )  # fmt: skip
        logs = {path.stem: path for path in sorted(Path(self.folder).glob("*.npz"))}
        chosen = {"": [name for name in logs if name != VALIDATION], "validation": [VALIDATION]}
        return {
            part: RecordingTables(description, URDF, [piece for name in names for piece in self._trials(logs[name])])
            for part, names in chosen.items()
        }

    def _trials(self, path: Path) -> list[TrialTable]:
        archive = read_npz(path)
        stamps = np.asarray(archive["time"], dtype=np.float64)
        time = np.arange(0.0, stamps[-1] - stamps[0], 1.0 / RATE)
        torque, position = (
            np.stack([np.interp(time, stamps - stamps[0], archive[f"{key}{joint}"]) for joint in (1, 2)], axis=1)
            for key in ("tau_meas", "pos_meas")
        )
        entry = TrialEntry(file=f"trials/{path.stem}.parquet", kind=path.stem)
        return list(cut_trial(TrialTable(entry, time, torque, position), self.length))
