"""Write a recording: recording.yaml, rig.urdf and one table a trial."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars
import yaml
from numpy.typing import NDArray

from tactile_cube.measurement.description import Description, TrialEntry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrialTable:
    """One trial to be written: its entry, time (n,) [s] and signals (n, joints); torque may be None."""

    entry: TrialEntry
    time: Array
    command: Array
    position: Array
    torque: Array | None = None


def write_recording(folder: Path, description: Description, urdf: str, tables: Sequence[TrialTable]) -> None:
    """Write a recording; `description.trials` is replaced by the entries of `tables`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / description.rig).write_text(urdf, encoding="utf-8")
    entries = [table.entry for table in tables]
    data = description.model_copy(update={"trials": entries}).model_dump(exclude_defaults=True, exclude_none=True)
    ordered = {"format": 1, "rig": description.rig} | data
    text = yaml.safe_dump(ordered, sort_keys=False, allow_unicode=True)
    (folder / "recording.yaml").write_text(text, encoding="utf-8")
    for table in tables:
        write_table(folder / table.entry.file, table, description.joints)


def write_table(path: Path, table: TrialTable, joints: Sequence[str]) -> None:
    """Write one trial as Parquet, CSV or NPZ, by the ending of `path`; signals as 32-bit numbers, time as 64-bit."""
    columns: dict[str, NDArray[np.floating]] = {"time": table.time}
    for index, joint in enumerate(joints):
        columns[f"{joint}.command"] = table.command[:, index].astype(np.float32)
        columns[f"{joint}.position"] = table.position[:, index].astype(np.float32)
        if table.torque is not None:
            columns[f"{joint}.torque"] = table.torque[:, index].astype(np.float32)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        np.savez_compressed(path, **columns)
    elif path.suffix == ".csv":
        polars.DataFrame(columns).write_csv(path)
    else:
        polars.DataFrame(columns).write_parquet(path)
