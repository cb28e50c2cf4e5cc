"""A recording of two joints, small enough to be written for every test, and without any simulation."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars
import yaml

URDF = """<robot name="two">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0 -0.03"/><mass value="0.05"/>
<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-0.5" upper="0.5" effort="1" velocity="10"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.1"/><axis xyz="1 0 0"/>
<limit lower="-0.6" upper="1.5" effort="1" velocity="10"/></joint>
</robot>"""

Table = dict[str, np.ndarray]


def description() -> dict[str, Any]:
    return {
        "format": 1,
        "rig": "rig.urdf",
        "gravity": [0.0, 0.0, -9.81],
        "rate_hz": 100,
        "joints": ["a", "b"],
        "controller": {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0},
        "nominal": {"stiffness": 25.0, "static_friction": 0.01, "reflected_inertia": 0.003},
        "sensors": {"position_resolution": 1e-4},
        "trials": [
            {"file": "first.parquet", "initialisation": 0, "kind": "sines"},
            {"file": "second.parquet", "initialisation": 1, "kind": "sines"},
        ],
    }


def table(seed: int = 0, samples: int = 300, noise: float = 2e-4, offset: float = 0.0) -> Table:
    """Positions that follow their commands 20 ms late, with sensor noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / 100
    columns: Table = {"time": time}
    for joint, frequency, amplitude in (("a", 0.8, 0.3), ("b", 0.5, 0.4)):
        columns[f"{joint}.command"] = amplitude * np.sin(2 * np.pi * frequency * time)
        position = amplitude * np.sin(2 * np.pi * frequency * (time - 0.02)) + offset
        columns[f"{joint}.position"] = position + noise * rng.normal(size=samples)
        columns[f"{joint}.torque"] = 3.0 * (columns[f"{joint}.command"] - columns[f"{joint}.position"])
    return columns


Change = Callable[[dict[str, Any]], None]


def setting(values: dict[str, object]) -> Change:
    """Set keys of recording.yaml, named as in errors: `trials.0.kind`."""

    def change(data: dict[str, Any]) -> None:
        for key, value in values.items():
            place: Any = data
            *groups, last = key.split(".")
            for group in groups:
                place = place[int(group) if group.isdigit() else group]
            place[last] = value

    return change


def write(
    folder: Path,
    change: Change = lambda data: None,
    spoil: Callable[[Table], None] = lambda columns: None,
    urdf: str = URDF,
) -> Path:
    """Write the recording; `change` edits recording.yaml, `spoil` the first trial."""
    data, first = description(), table(0)
    change(data)
    spoil(first)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.urdf").write_text(urdf)
    (folder / "recording.yaml").write_text(yaml.safe_dump(data))
    polars.DataFrame(first).write_parquet(folder / "first.parquet")
    polars.DataFrame(table(1, offset=0.01)).write_parquet(folder / "second.parquet")
    return folder
