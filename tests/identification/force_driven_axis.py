"""A sliding axis driven by force, simulated by a few lines of its own."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars
import yaml
from numpy.typing import NDArray

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording

Array = NDArray[np.float64]
MASS, DRY, VISCOUS = 2.0, 1.0, 6.0  # [kg], [N], [N s/m]
STEP, FINE, SAMPLES = 0.002, 10, 1500
START = 0.02  # [m]
URDF = """<robot name="axis"><link name="base"/><link name="carriage"><inertial><origin xyz="0 0 0"/>
<mass value="{mass}"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 0 0"/>{limit}</joint>
</robot>"""
LIMIT = '<limit lower="-0.05" upper="0.3" effort="40" velocity="1.5"/>'
REFERENCES: dict[str, Callable[[float], float]] = {
    "sines": lambda t: START + 0.1 * (1.0 - np.cos(4.0 * t)),
    "quick": lambda t: START + 0.05 * (1.0 - np.cos(11.0 * t)),
}


def played(force: Callable[[int, float, float], float], rows: int) -> tuple[Array, Array]:
    """Position and force (rows,) of the axis from rest, under a force of row, position and speed."""
    position, speed, dt = START, 0.0, STEP / FINE
    log = np.zeros((2, rows))
    for row in range(rows):
        pushed = force(row, position, speed)
        log[:, row] = position, pushed
        for _ in range(FINE):
            free = speed + dt * (pushed - VISCOUS * speed) / MASS
            speed = np.sign(free) * max(abs(free) - dt * DRY / MASS, 0.0)
            position += dt * speed
    return log[0], log[1]


def recorded(folder: Path, limit: str = LIMIT) -> Recording:
    """Four trials in which a controller that nobody logged moved the axis, and its force was logged."""
    rng, logs = np.random.default_rng(0), {}
    for kind, reference in REFERENCES.items():

        def controlled(row: int, position: float, speed: float, to: Callable[[float], float] = reference) -> float:
            return 400.0 * (to(STEP * row) - position) - 30.0 * speed

        position, force = played(controlled, SAMPLES)
        logs |= {f"{kind}_{n}": (force, position + 1e-5 * rng.normal(size=SAMPLES)) for n in (0, 1)}
    return written(folder, logs, limit)


def written(
    folder: Path,
    logs: Mapping[str, tuple[Array, Array]],
    limit: str,
    step: float = STEP,
    mass: float = MASS,
    dry: float = 0.8 * DRY,
) -> Recording:
    """A recording of logged forces and positions, by kind and number; mass and dry friction are what is believed."""
    described: dict[str, Any] = {
        "format": 1,
        "gravity": [0.0, 0.0, -9.81],
        "rate_hz": 1.0 / step,
        "joints": ["a"],
        "controller": {"mode": "torque"},
        "nominal": {"static_friction": dry},
        "sensors": {"read": "before"},
        "trials": [{"file": f"{name}.parquet", "initialisation": 0, "kind": name.split("_")[0]} for name in logs],
    }
    (folder / "rig.urdf").write_text(URDF.format(limit=limit, mass=mass))
    (folder / "recording.yaml").write_text(yaml.safe_dump(described))
    for name, (force, position) in logs.items():
        columns = {"time": step * np.arange(len(force)), "a.command": force, "a.position": position}
        polars.DataFrame(columns).write_parquet(folder / f"{name}.parquet")
    return read_recording(folder)
