"""What the loop sent and what the hand measured, kept as a recording that `compare` reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.limits import JointLimits
from tactile_cube.deployment.robot import Reading
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.dlr_hand2 import REFLECTED_INERTIA, STATIC_FRICTION, STIFFNESS
from tactile_cube.measurement.recordings.description import Controller, Coupling, Description, Sensors, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording

Array = NDArray[np.float64]


@dataclass
class RunLog:
    """One run of the loop, a row a measurement that was believed: time, measured, sent then."""

    time: list[float] = field(default_factory=list)
    command: list[Array] = field(default_factory=list)
    position: list[Array] = field(default_factory=list)
    torque: list[Array] = field(default_factory=list)

    def add(self, reading: Reading, q_d: Array) -> None:
        """Take over one tick; one without a measurement leaves a gap in the recording."""
        self.time.append(reading.time)
        self.command.append(np.array(q_d))
        self.position.append(np.array(reading.q_m))
        self.torque.append(np.full(len(reading.q_m), np.nan) if reading.torque is None else np.array(reading.torque))

    def table(self, number: int) -> TrialTable:
        """The run as a trial of kind `policy`, its time from 0 [s]."""
        entry = TrialEntry(file=f"trials/run_{number}.parquet", initialisation=number, kind="policy")
        torque = np.array(self.torque)
        measured = None if np.isnan(torque).any() else torque
        time = np.array(self.time) - self.time[0]
        return TrialTable(entry, time, np.array(self.command), np.array(self.position), measured)


def write_runs(
    runs: Sequence[RunLog], folder: Path, limits: JointLimits, rate: float, resolution: float, hand: Hand = DLR_HAND2
) -> Path:
    """Write runs of the loop as one recording: of the hand alone, for no object is described.

    Args:
        runs: one trial each.
        folder: where.
        limits: of the loop; its gains are the controller's.
        rate: of the fast loop [Hz].
        resolution: of the measured angles [rad].
        hand: that was run.
    """
    nominal = {"stiffness": STIFFNESS, "static_friction": STATIC_FRICTION, "reflected_inertia": REFLECTED_INERTIA}
    told = {key: hand.drive.get(key, value) for key, value in nominal.items()}
    followers = {
        hand.chain_joints(k)[link]: hand.chain_joints(k)[leader]
        for k in range(len(hand.fingers))
        for link, leader in hand.coupled()
    }
    description = Description(
        format=1,
        gravity=[float(value) for value in hand.rotation.T @ (0.0, 0.0, -9.81)],
        rate_hz=rate,
        joints=list(hand.joint_names),
        coupled={name: Coupling(joint=leader) for name, leader in followers.items()},
        controller=Controller(
            kp=[float(value) for value in limits.kp], kd=[float(value) for value in limits.kd],
            torque_limit=limits.torque,
        ),
        nominal={key: np.asarray(value).tolist() for key, value in told.items()},
        sensors=Sensors(read="before", position_resolution=resolution),
        trials=[TrialEntry(file="none")],
        source="log of the control loop",
    )  # fmt: skip
    tables = [run.table(number) for number, run in enumerate(runs)]
    write_recording(folder, RecordingTables(description, hand.urdf(), tables))
    return folder
