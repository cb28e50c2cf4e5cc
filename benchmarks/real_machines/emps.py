"""Electro-mechanical positioning system: a linear axis with a ball screw, logged with its force, 1 kHz.

Source: Janot, Gautier, Brunot, Data Set and Reference Models of EMPS, Nonlinear System Identification Benchmarks 2019.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, cut_trial
from tactile_cube.measurement.replay.model import Model, no_offsets
from tactile_cube.measurement.replay.simulator import Simulator
from tactile_cube.measurement.replay.windows import whole_trials
from tactile_cube.measurement.sources.source import described
from tactile_cube.untrusted_file import read_npz

MASS = 95.11  # [kg] published
RATE = 1000.0  # [Hz]
URDF = f"""<?xml version="1.0"?>
<robot name="emps">
<link name="base"/>
<link name="carriage"><inertial><mass value="{MASS}"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 0 0"/>
<limit lower="-0.05" upper="0.3" effort="350" velocity="1"/></joint>
</robot>
"""


@dataclass(frozen=True)
class Emps:
    """Imports emps_sweep.npz and emps_pulses.npz; the logged force is the command.

    Attributes:
        folder: with both archives.
        length: of a trial [s]; the motion repeats itself after 6.2 s.
    """

    folder: str
    length: float = 6.2

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """The sweep to identify with, cut into its periods, and the pulses in one piece to validate with."""
        description = described(
            gravity=[0.0, 0.0, -9.81], rate_hz=RATE, joints=["slide"], controller={"mode": "torque"},
            sensors={"read": "before"}, source="EMPS, nonlinear benchmark of Janot, Gautier and Brunot",
        )  # fmt: skip
        return {
            "": RecordingTables(description, URDF, cut_trial(self._trial("sweep"), self.length)),
            "validation": RecordingTables(description, URDF, [self._trial("pulses")]),
        }

    def _trial(self, name: str) -> TrialTable:
        archive = read_npz(Path(self.folder) / f"emps_{name}.npz")
        force, position = (np.asarray(archive[key], dtype=np.float64)[:, None] for key in ("force_N", "position_m"))
        return TrialTable(
            TrialEntry(file=f"trials/{name}.parquet", kind=name), np.arange(len(force)) / RATE, force, position
        )


INITIAL = 20  # samples that initialise, by the benchmark's rule
STEP = 0.00025  # [s] of the simulation


def official_error(pulses: Recording, model: Model) -> float:
    """RMSE [m] of a free run of the pulses from a state that the first samples give, over all samples after them.

    Source: rules of the nonlinear benchmark, nonlinearbenchmark.org, EMPS.
    """
    (trial,) = pulses.trials
    simulator = Simulator(pulses, [term.effect for term in model.terms], STEP)
    _, speed, position = np.polyfit(trial.time[:INITIAL], trial.position[:INITIAL, 0], 2)
    windows = whole_trials(pulses, pulses.trials, simulator.substeps)
    begun = replace(windows, position=np.full((1, 1, 1), position), speed=np.full((1, 1, 1), speed))
    run = simulator.simulate([model.with_offsets(no_offsets(pulses))], [begun])[0, 0, 0, :, 0]
    return float(np.sqrt(np.mean((run[INITIAL:] - trial.position[INITIAL:, 0]) ** 2)))
