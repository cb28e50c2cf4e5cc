"""Simulated recordings of one joint, turning or sliding, with every mass, length and time multiplied at will."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars
import yaml

from tactile_cube.drivetrain.effects import Effect, find_effect
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term, nominal_model
from tactile_cube.measurement.replay.windows import cut

URDF = """<robot name="single"><link name="base"/><link name="arm"><inertial><origin xyz="0 0 {com:.12g}"/>
<mass value="{mass:.12g}"/><inertia ixx="{inertia:.12g}" iyy="{inertia:.12g}" izz="{inertia:.12g}" ixy="0" ixz="0"
iyz="0"/></inertial></link><joint name="a" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="{lower:.12g}" upper="{upper:.12g}" effort="1e9" velocity="1e9"/></joint></robot>"""
NAMES = ("coulomb_friction", "viscous_friction", "nonlinear_drag", "backlash", "actuator_lag", "payload")
EFFECTS = tuple(find_effect(name) for name in NAMES)
NOISE = 2e-4  # [rad]
SAMPLES, STEP = 1500, 0.002
STATED = {"kp": 4.0, "kd": 0.2, "torque_limit": 4.0, "stiffness": 40.0, "static_friction": 0.02}


@dataclass(frozen=True)
class Size:
    """What mass, length and time are multiplied with, and what units become of it."""

    mass: float = 1.0
    length: float = 1.0
    time: float = 1.0
    slides: bool = False

    @property
    def position(self) -> float:
        return self.length if self.slides else 1.0

    @property
    def inertia(self) -> float:
        return self.mass if self.slides else self.mass * self.length**2

    @property
    def torque(self) -> float:
        return self.inertia * self.position / self.time**2

    @property
    def damping(self) -> float:
        return self.torque * self.time / self.position


def simulated(
    folder: Path,
    size: Size,
    effect: type[Effect],
    values: dict[str, float],
    wound: float = 0.0,
    repeats: int = 2,
    every: float = 0.0,
    balanced: bool = True,
) -> Recording:
    """Trials of two kinds, each repeated, of a rig with a hidden effect (its values at the size wanted).

    An integral of its controller begins `wound` [N m] beyond balance. A trial begins `every` so many seconds.
    Bristles of its friction begin `balanced` or unbent.
    """
    stated = _stated(size)
    trials = [
        {"file": f"{kind}{n}.parquet", "initialisation": 0, "kind": kind} for n in range(repeats) for kind in COMMANDS
    ]
    described: dict[str, Any] = {
        "format": 1,
        "gravity": [0.0, 0.0, -9.81 * size.length / size.time**2],
        "rate_hz": 1.0 / (STEP * size.time),
        "joints": ["a"],
        "controller": {key: stated[key] for key in ("kp", "kd", "torque_limit")},
        "nominal": {key: stated[key] for key in ("stiffness", "static_friction", "reflected_inertia")},
        "trials": trials,
    }
    span = 3.0 * size.position
    arm = {"com": -0.1 * size.length, "mass": 0.2 * size.mass, "inertia": 1e-4 * size.mass * size.length**2}
    text = URDF.format(kind="prismatic" if size.slides else "revolute", lower=-span, upper=span, **arm)
    (folder / "rig.urdf").write_text(text)
    (folder / "recording.yaml").write_text(yaml.safe_dump(described))
    time = STEP * np.arange(SAMPLES)
    begun = every * np.arange(len(trials))
    for trial, start in zip(trials, begun, strict=True):
        command = size.position * COMMANDS[str(trial["kind"])](time)
        columns = {"time": start + size.time * time, "a.command": command, "a.position": 0.95 * command}
        polars.DataFrame(columns).write_parquet(folder / str(trial["file"]))
    planned = read_recording(folder)
    shooting = Shooting(planned, EFFECTS)
    windows = cut(planned, np.ones(1), segment=SAMPLES, time=shooting.time)
    windows = replace(windows, wound=np.full_like(windows.wound, wound), balanced=windows.balanced & balanced)
    plain = nominal_model(planned)
    known = effect("a", **values)
    model = Model(plain.constants, (Term(effect, "a", known.values, ()),), plain.offsets)
    played = shooting.positions([model], windows)[0]
    rng = np.random.default_rng(1)
    for entry, start, trial, ideal in zip(trials, begun, planned.trials, played, strict=True):
        position = ideal[:, 0] + NOISE * size.position * rng.normal(size=SAMPLES)
        columns = {"time": start + trial.time, "a.command": trial.command[:, 0], "a.position": position}
        polars.DataFrame(columns).write_parquet(folder / str(entry["file"]))
    return read_recording(folder)


def _stated(size: Size) -> dict[str, float]:
    units = {
        "kp": size.torque / size.position,
        "kd": size.damping,
        "torque_limit": size.torque,
        "stiffness": size.torque / size.position,
        "static_friction": size.torque,
    }
    return {key: STATED[key] * unit for key, unit in units.items()} | {"reflected_inertia": 0.004 * size.inertia}


COMMANDS = {
    "sines": lambda t: 0.6 * np.sin(5.0 * t) + 0.3 * np.sin(13.0 * t + 1.0),
    "triangles": lambda t: 1.2 * np.abs(2.0 * (t / 1.5 - np.floor(t / 1.5 + 0.5))) - 0.6,
}
