"""A recording out of arrays, for programs that have measured signals in memory."""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import ValidationError

from tactile_cube.drivetrain.plain_yaml import describe
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.recordings.description import Description, PerJoint, TrialEntry
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording


@dataclass(frozen=True)
class TrialArrays:
    """One trial, sampled at the recording's rate.

    Attributes:
        command: desired joint angles (n, joints) [rad].
        position: measured joint angles (n, joints) [rad].
        torque: measured joint torques (n, joints) [N m]; None: not measured.
        kind: of excitation; trials of one kind repeat one command.
        initialisation: of the robot that it belongs to; each has joint offsets of its own.
        link_position: measured on the link side (n, joints) [rad], nan where a joint has no sensor; None: nowhere.
        feedforward: torques (n, joints) [N m] that the controller added to its own; None: it added none.
    """

    command: ArrayLike
    position: ArrayLike
    torque: ArrayLike | None = None
    kind: str = "unspecified"
    initialisation: int = 0
    link_position: ArrayLike | None = None
    feedforward: ArrayLike | None = None


def recording_from_arrays(
    trials: Sequence[TrialArrays],
    joints: Sequence[str],
    urdf: str | Path,
    rate: float,
    kp: PerJoint = 0.0,
    kd: PerJoint = 0.0,
    torque_limit: PerJoint = float("inf"),
    nominal: Mapping[str, PerJoint] | None = None,
    gravity: Sequence[float] = (0.0, 0.0, -9.81),
    read: Literal["before", "after"] = "before",
    resolution: float = 0.0,
    folder: str | Path | None = None,
    mode: Literal["position", "torque"] = "position",
) -> Recording:
    """Build a recording for `compare`, `diagnose` and `identify`, checked as if it had been read from disk.

    Args:
        trials: what was measured.
        joints: names in the URDF, in the order of the columns.
        urdf: path of the rig's URDF or MJCF, or the text of a URDF.
        rate: samples per second [Hz].
        kp: stiffness of the impedance controller [N m/rad], one number or one for each joint; not used in torque mode.
        kd: its damping [N m s/rad].
        torque_limit: its limit [N m].
        nominal: assumed values of the drive: stiffness [N m/rad], static_friction [N m], reflected_inertia [kg m^2].
        gravity: in the base frame (3,) [m/s^2].
        read: whether a row's position was read before its command was sent, as most loops log, or after it acted.
        resolution: of the position [rad].
        folder: where to keep it; None: nowhere.
        mode: whether commands are positions, or the torques [N m] (forces [N]) that moved the joints.

    Raises:
        InputError: naming trial, joint and value of what cannot be used.

    Example:
        >>> trial = TrialArrays(command=q_d, position=q, torque=tau, kind="ramps")
        >>> recording = recording_from_arrays([trial, ...], ["elbow"], "arm.urdf", rate=500.0, kp=3.7, kd=0.25)
    """
    if isinstance(rate, bool) or not (isinstance(rate, Real) and 0 < rate < float("inf")):
        raise InputError(f"rate is {rate!r}; give the samples per second")
    if isinstance(trials, TrialArrays) or not all(isinstance(trial, TrialArrays) for trial in trials):
        raise InputError("trials: expected a list of TrialArrays")
    described: dict[str, object] = {
        "format": 1, "rate_hz": rate, "joints": list(joints), "gravity": gravity, "nominal": dict(nominal or {}),
        "controller": {"kp": kp, "kd": kd, "torque_limit": torque_limit, "mode": mode},
        "sensors": {"read": read, "position_resolution": resolution},
    }  # fmt: skip
    try:
        tables = [_table(trial, number, len(joints), rate) for number, trial in enumerate(trials)]
        description = Description.model_validate(described | {"trials": [table.entry for table in tables]})
        text = urdf if isinstance(urdf, str) and urdf.lstrip().startswith("<") else read_rig(Path(urdf)).text
        recording = RecordingTables(description, text, tables)
        with tempfile.TemporaryDirectory() if folder is None else nullcontext(folder) as place:
            made = Path(place) if folder is not None else Path(place) / "arrays"
            write_recording(made, recording)
            return read_recording(made)
    except ValidationError as error:
        raise InputError(describe(error)) from error
    except OSError as error:
        raise InputError(f"{error.filename}: {error.strerror}") from error


def _table(trial: TrialArrays, number: int, joints: int, rate: float) -> TrialTable:
    given = {name: getattr(trial, name) for name in SIGNALS}
    signals = {name: None if one is None else _signal(one, name, number, joints) for name, one in given.items()}
    for name in ("command", "position"):
        if signals[name] is None:
            raise InputError(f"trials[{number}]: {name} is None; give (samples, joints)")
    found: dict[str, Any] = {name: signal for name, signal in signals.items() if signal is not None}
    samples, file = len(found["command"]), f"trials/{trial.kind}_{number}.parquet"
    for name, signal in found.items():
        if len(signal) != samples:
            raise InputError(f"trials[{number}]: {name} has {len(signal)} samples, command has {samples}")
    entry = TrialEntry(file=file, initialisation=trial.initialisation, kind=trial.kind)
    return TrialTable(entry, np.arange(samples) / rate, **found)


def _signal(values: ArrayLike, name: str, number: int, joints: int) -> NDArray[np.float64]:
    try:
        signal = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"trials[{number}]: {name} holds no numbers: {error}") from None
    if not np.isfinite(signal).any():
        raise InputError(f"trials[{number}]: {name} has no finite number")
    if signal.ndim == 1 and joints == 1:
        signal = signal[:, None]
    if signal.ndim != 2 or signal.shape[1] != joints:
        raise InputError(f"trials[{number}]: {name} has shape {signal.shape}; expected (samples, {joints})")
    return signal
