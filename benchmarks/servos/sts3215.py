"""Feetech STS3215 12 V, the servo of the SO-101 arm, on a pendulum bench: 237 runs of K-Scale Labs.

Source: github.com/kscalelabs/sysid, commit d66b22c, data/feetech/STS_3215_12V_20250317.
"""

import json
from pathlib import Path

import numpy as np

from benchmarks.servos.servo import Run, Servo, pieces
from tactile_cube.untrusted_file import read_npz

COLUMNS = ("time", "goal_position", "position", "torque_enable")
EVERY = 2  # rows: the log was interpolated to 200 Hz from 100 Hz
FITTED = (0.969, 0.15)  # [kg], [m] the load whose runs are fitted; the seven others are not
STALL, NO_LOAD = 2.94, 4.71  # [N m], [rad/s] data sheet of the STS3215-C018 at 12 V: 30 kg cm, 0.222 s a 60 degrees


def sts3215(folder: Path) -> Servo:
    """The servo with its runs in sts3215.npz and runs.json."""
    archive = read_npz(folder / "sts3215.npz")
    runs: list[Run] = []
    for one in json.loads((folder / "runs.json").read_text()):
        name, load = f"{one['run']:03d}", (float(one["mass"]), float(one["length"]))
        columns = [archive[f"{name}.{column}"][::EVERY].astype(np.float64) for column in COLUMNS]
        runs += pieces(name, one["trajectory"], int(one["kp"]), load, load == FITTED, columns)
    return Servo(
        name="sts3215",
        runs=runs,
        volts=12.0,
        duty=0.164891,  # measured by K-Scale Labs
        most_duty=0.97,
        stall=STALL,
        no_load=NO_LOAD,
        usual_gain=16,  # LeRobot's for the SO-101
        static_friction=0.052,  # MuJoCo Menagerie, SO-ARM100
        reflected_inertia=0.028,  # likewise
        rod=0.036,
        rate=200.0 / EVERY,
        source="kscalelabs/sysid STS_3215_12V_20250317; kp = gain x stall torque, kd = back-EMF, from the data sheet",
    )
