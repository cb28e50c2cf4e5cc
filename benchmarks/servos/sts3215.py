"""Feetech STS3215 12 V, the servo of the SO-101 arm, on a pendulum bench: 237 runs of K-Scale Labs.

Source: github.com/kscalelabs/sysid, commit d66b22c, data/feetech/STS_3215_12V_20250317.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.measurement.recordings.description import ControllerChange, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

Array = NDArray[np.float64]
Load = tuple[float, float]
"""Mass [kg] at the arm's end and its length [m]."""
ROD = 0.036  # [kg] mass of the arm itself
EVERY = 2  # rows: the log was interpolated to 200 Hz from 100 Hz
ERROR_GAIN = 0.164891  # duty of one firmware gain at one radian of error, measured by K-Scale Labs
STALL, NO_LOAD = 2.94, 4.71  # [N m], [rad/s] data sheet of the STS3215-C018 at 12 V: 30 kg cm, 0.222 s a 60 degrees
USUAL_GAIN = 16  # of the firmware, LeRobot's for the SO-101
REFLECTED_INERTIA, STATIC_FRICTION = 0.028, 0.052  # [kg m^2], [N m] MuJoCo Menagerie, SO-ARM100
OFF = 1e-6  # part of the gains that stays with the torque off: none, but for a division by it
FITTED: Load = (0.969, 0.15)
FITTED_GAINS = (8, 32)
FALL = "drop"
PARTS = {"lift_and_drop": "lift"}
"""Names of what comes before the torque goes off, where it does."""


@dataclass(frozen=True)
class Run:
    """A run, or what of one is driven or falls.

    Attributes:
        name: unique.
        kind: of trajectory; `drop` with the torque off.
        gain: P gain of the firmware.
        load: mass [kg] and length [m] of the pendulum.
        time: (n,) [s] from its start.
        command: (n,) [rad].
        position: (n,) [rad].
    """

    name: str
    kind: str
    gain: int
    load: Load
    time: Array
    command: Array
    position: Array

    @property
    def fitted(self) -> bool:
        """Whether models are fitted to it."""
        return self.load == FITTED and self.gain in FITTED_GAINS

    @property
    def driven(self) -> bool:
        """Whether the torque is on."""
        return self.kind != FALL


@dataclass(frozen=True)
class Sts3215:
    """Imports sts3215.npz and runs.json.

    Attributes:
        folder: where they lie.
    """

    folder: Path

    @cached_property
    def runs(self) -> list[Run]:
        """All runs; those that switch the torque off become two."""
        archive = read_npz(self.folder / "sts3215.npz")
        listed = json.loads((self.folder / "runs.json").read_text())
        return [part for one in listed for part in _parts(one, archive)]

    def recordings(self, fitted: bool) -> dict[str, RecordingTables]:
        """What models are fitted to as one recording, or what they never see, a recording for each load."""
        chosen = [run for run in self.runs if run.fitted == fitted]
        loads = sorted({run.load for run in chosen})
        return {f"{load[0]:.3g}kg_{1e3 * load[1]:.0f}mm": _recording(load, chosen) for load in loads}


def stiffness(gain: int) -> float:
    """Joint stiffness [N m/rad] of a firmware gain by the data sheet."""
    return float(gain * ERROR_GAIN * STALL)


def _parts(one: dict[str, float | str], archive: dict[str, NDArray[np.generic]]) -> list[Run]:
    number, kind, load = f"{one['run']:03d}", str(one["trajectory"]), (float(one["mass"]), float(one["length"]))
    keys = ("time", "goal_position", "position", "torque_enable")
    time, command, position, on = (archive[f"{number}.{key}"][::EVERY].astype(np.float64) for key in keys)
    end = int(np.argmax(on < 0.5)) if (on < 0.5).any() else len(on)
    pieces = [(PARTS.get(kind, kind), slice(0, end)), (FALL, slice(end, len(on)))]
    return [
        Run(f"{number}_{name}", name, int(one["kp"]), load, time[rows] - time[rows][0], command[rows], position[rows])
        for name, rows in pieces
        if len(time[rows])
    ]


def _recording(load: Load, runs: list[Run]) -> RecordingTables:
    mass, length = load
    total = mass + ROD
    middle = (mass + ROD / 2) * length / total
    inertia = (mass + ROD / 3) * length**2 - total * middle**2  # a point and a thin rod, about their common centre
    description = described(
        gravity=[0.0, 0.0, -9.80665], rate_hz=200.0 / EVERY, joints=["servo"],
        controller={"kp": stiffness(USUAL_GAIN), "kd": STALL / NO_LOAD},
        nominal={"static_friction": STATIC_FRICTION, "reflected_inertia": REFLECTED_INERTIA},
        sensors={"read": "before", "position_resolution": 2 * np.pi / 4096},
        unknown=["kp", "kd", "reflected_inertia"],
        source="kscalelabs/sysid STS_3215_12V_20250317; kp = gain x stall torque, kd = back-EMF, from the data sheet",
    )  # fmt: skip
    urdf = single_joint_urdf("sts3215", "servo", total, middle, inertia)
    return RecordingTables(description, urdf, [_trial(run) for run in runs if run.load == load])


def _trial(run: Run) -> TrialTable:
    kp, kd = stiffness(run.gain), STALL / NO_LOAD
    controller = ControllerChange(kp=kp) if run.driven else ControllerChange(kp=OFF * kp, kd=OFF * kd)
    entry = TrialEntry(file=f"trials/{run.name}.parquet", kind=f"{run.kind}_{run.gain}", controller=controller)
    return TrialTable(entry, run.time, run.command[:, None], run.position[:, None])
