"""What is left of a controller at 10 kHz in a model that computes its torque at the log's rate, and with the key.

    python -m benchmarks.blind.controller_rate

Records a finger and a carriage of 90 kg with true constants in steps of 0.1 ms, logs them at 500 Hz, and simulates the
recordings without `controller.rate_hz` and with 2 and 10 kHz.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import yaml

from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tactile_cube.measurement.units import milli

CARRIAGE = """<robot name="axis"><link name="base"/>
<link name="carriage"><inertial><mass value="90"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 0 0"/>
<limit lower="-0.5" upper="0.5" effort="3000" velocity="3"/></joint></robot>"""
RIGS: dict[str, dict[str, Any]] = {
    "finger": {
        "controller": {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0},
        "nominal": {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003},
    },
    "carriage": {
        "controller": {"kp": 1e5, "kd": 4e3, "torque_limit": 1e9},
        "nominal": {"stiffness": float("inf"), "static_friction": 20.0, "reflected_inertia": 0.0},
        "noise": 4e-6, "resolution": 1e-6, "torque_noise": 0.1,
    },
}  # fmt: skip
RATES = (None, 2000.0, 10000.0)


def left(rig: str, folder: Path) -> None:
    """Record one rig and print what each rate leaves."""
    (folder / "carriage.urdf").write_text(CARRIAGE)
    urdf = "finger" if rig == "finger" else str(folder / "carriage.urdf")
    source = SimulatedRig(
        urdf=urdf, true_spread=0.0, offset=0.0, initialisations=1, duration=4.0,
        kinds=("ramps", "multisine", "policy"), step=1e-4, validation=False, **RIGS[rig],
    )  # fmt: skip
    write_recording(folder / rig, source.recordings(0)[""])
    file = folder / rig / "recording.yaml"
    plain = yaml.safe_load(file.read_text())
    for rate in RATES:
        controller = plain["controller"] | ({} if rate is None else {"rate_hz": rate})
        file.write_text(yaml.safe_dump(plain | {"controller": controller}))
        recording = read_recording(folder / rig)
        simulated = free_run(recording, nominal_model(recording))
        errors = free_run_error(recording, simulated)
        shown = ", ".join(f"{joint} {milli(error, recording.units[joint])}" for joint, error in errors.joints.items())
        print(f"{rig}, controller at {f'{rate:g} Hz' if rate else 'the log rate'}: {shown}", flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        for name in RIGS:
            left(name, Path(place))
