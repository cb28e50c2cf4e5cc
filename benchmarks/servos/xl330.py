"""Dynamixel XL330, a servo of a finger's size, on a pendulum bench: 16 runs with one load.

Source: github.com/Rhoban/bam, branch xl330 (Apache-2.0); Duclusaud et al., ICRA 2025, arXiv 2410.08650.
"""

from pathlib import Path

import numpy as np

from benchmarks.real_machines import bam_xl330 as bam
from benchmarks.servos.servo import Run, Servo, pieces
from tactile_cube.untrusted_file import read_npz

COLUMNS = ("t_s", "goal_rad", "q_rad", "torque_enable")


def xl330(folder: Path) -> Servo:
    """The servo with its runs in xl330.npz; those of one gain are not fitted."""
    archive = read_npz(folder / "xl330.npz")
    names = [str(name) for name in archive.pop("columns")]
    runs: list[Run] = []
    for name, data in archive.items():
        motion, _, gain = name.rpartition("_kp")
        columns = [data[:, names.index(column)].astype(np.float64) for column in COLUMNS]
        grid = np.arange(columns[0][0], columns[0][-1], 1.0 / bam.RATE)
        even = [grid, *(np.interp(grid, columns[0], column) for column in columns[1:])]
        load = (bam.MASS, bam.LENGTH)
        runs += pieces(f"kp{gain}", motion, int(gain), load, int(gain) != bam.HELD_OUT, even)
    return Servo(
        name="xl330",
        runs=runs,
        volts=7.4,
        duty=bam.DUTY_PER_GAIN,
        most_duty=1.0,
        stall=bam.STALL_TORQUE,
        no_load=bam.NO_LOAD_SPEED,
        usual_gain=400,  # BAM's
        static_friction=0.01,
        reflected_inertia=bam.REFLECTED_INERTIA,
        rod=0.0,
        rate=bam.RATE,
        source="Rhoban/bam xl330 (Apache-2.0); kp = gain x stall torque, kd = back-EMF, from the data sheet",
    )
