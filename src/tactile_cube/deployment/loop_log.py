"""Log of the control loop: on disk while the loop runs, a recording once it has ended."""

from __future__ import annotations

import queue
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from tactile_cube.deployment.robot import Array, JointLimits, Reading
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.dlr_hand2 import REFLECTED_INERTIA, STATIC_FRICTION, STIFFNESS
from tactile_cube.measurement.recordings.description import Controller, Coupling, Description, Sensors, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording

Rows = NDArray[np.void]
"""Rows of a log: `time` [s] and `position`, `command` [rad], `torque` [N m] `(joints,)`, nan where not measured."""
CHUNK = 500  # rows that are written at a time: what a crash may cost
BEHIND = 20  # chunks that may wait for the disk


class LoopLog:
    """Measurements that were believed and the commands that were sent then, in an `.npy` file that grows.

    A thread writes, so that no tick waits for the disk. Whenever the program ends, by a crash too, `numpy.load` reads
    the file up to the last chunk. Time counts from the first row.

    Args:
        path: file to write.
        joints: of the hand.
    """

    def __init__(self, path: Path, joints: int) -> None:
        self.path, self._joints = path, joints
        signals = [(name, "<f8", (joints,)) for name in ("position", "command", "torque")]
        self._type = np.dtype([("time", "<f8"), *signals])
        self._filling, self._filled, self._written = np.empty(CHUNK, self._type), 0, 0
        self._chunks: queue.Queue[Rows | None] = queue.Queue(BEHIND)
        self._failure: OSError | None = None
        self._began: float | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._write(self._filling[:0])
        self._thread = threading.Thread(target=self._write_chunks, name="log", daemon=True)
        self._thread.start()

    def __enter__(self) -> LoopLog:
        return self

    def __exit__(self, *_: object) -> None:
        """Write what waits and close the file.

        Raises:
            OSError: it could not be written.
        """
        self._chunks.put(self._filling[: self._filled])
        self._chunks.put(None)
        self._thread.join()
        self._file.close()
        if self._failure is not None:
            raise self._failure

    @property
    def rows(self) -> Rows:
        """What was written, read from the disk where it is looked at."""
        return np.asanyarray(np.load(self.path, mmap_mode="r" if self._written else None))

    def append(self, reading: Reading, command: Array) -> None:
        """Add a row.

        Raises:
            OSError: the disk is full, or too slow.
        """
        torque = np.nan if reading.torque is None else reading.torque
        self._began = reading.time if self._began is None else self._began
        row: Any = self._filling[self._filled]
        row["time"], row["torque"] = reading.time - self._began, torque
        row["position"], row["command"] = reading.q_m, command
        self._filled += 1
        if self._filled < CHUNK:
            return
        if self._failure is not None:
            raise self._failure
        try:
            self._chunks.put_nowait(self._filling)
        except queue.Full:
            raise OSError(f"{self.path}: the disk is {BEHIND * CHUNK} rows behind the loop") from None
        self._filling, self._filled = np.empty(CHUNK, self._type), 0

    def _write_chunks(self) -> None:
        while (chunk := self._chunks.get()) is not None:
            try:
                if self._failure is None:
                    self._write(chunk)
            except OSError as error:
                error.filename = error.filename or str(self.path)
                self._failure = error

    def _write(self, chunk: Rows) -> None:
        """Append rows; the header, whose length stays, counts them only when they are in the file."""
        self._file.write(chunk.tobytes())
        self._file.flush()
        self._written += len(chunk)
        self._file.seek(0)
        described = {"descr": npy.dtype_to_descr(self._type), "fortran_order": False, "shape": (self._written,)}
        npy.write_array_header_1_0(self._file, described)
        self._file.seek(0, 2)
        self._file.flush()


def write_runs(
    runs: Sequence[Rows], folder: Path, limits: JointLimits, rate: float, resolution: float, hand: Hand = DLR_HAND2
) -> Path:
    """Write runs of the loop as one recording, a trial each: of the hand alone, for no object is described.

    The gains of `limits` are the controller's; `rate` is the fast loop's [Hz], `resolution` the sensors' [rad].
    """
    nominal = {"stiffness": STIFFNESS, "static_friction": STATIC_FRICTION, "reflected_inertia": REFLECTED_INERTIA}
    told = {key: hand.drive.get(key, value) for key, value in nominal.items()}
    chains = [hand.chain_joints(k) for k in range(len(hand.fingers))]
    description = Description(
        format=1,
        gravity=(hand.rotation.T @ (0.0, 0.0, -9.81)).tolist(),
        rate_hz=rate,
        joints=list(hand.joint_names),
        coupled={chain[link]: Coupling(joint=chain[leader]) for chain in chains for link, leader in hand.coupled()},
        controller=Controller(kp=limits.kp.tolist(), kd=limits.kd.tolist(), torque_limit=limits.torque),
        nominal={key: np.asarray(value).tolist() for key, value in told.items()},
        sensors=Sensors(read="before", position_resolution=resolution),
        trials=[TrialEntry(file="none")],
        source="log of the control loop",
    )
    tables = []
    for number, run in enumerate(runs):  # their signals stay on the disk
        entry = TrialEntry(file=f"trials/run_{number}.parquet", initialisation=number, kind="policy")
        measured = not np.isnan(run["torque"].min())  # a copy of them all would not fit into the memory
        signals = (run["time"], run["command"], run["position"], run["torque"] if measured else None)
        tables.append(TrialTable(entry, *signals))
    write_recording(folder, RecordingTables(description, hand.urdf(), tables))
    return folder
