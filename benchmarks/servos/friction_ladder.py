"""Published friction models (M1 to M6) in a simulator like their authors', all runs at once.

Source: Duclusaud et al., Extended friction models for the physics simulation of servo actuators, ICRA 2025, arXiv
2410.08650; github.com/Rhoban/bam. A model without a term has a zero in its place.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from benchmarks.servos.servo import Run, Servo

Array = NDArray[np.float64]
STEP = 0.005  # [s] of the authors' simulator
GRAVITY = 9.80665
UNUSED = {"dtheta_stribeck": 1.0, "alpha": 1.0, "max_velocity": np.inf}
"""What a model without them has: a zero would divide by zero, or hold the command."""


def published(servo: str) -> dict[str, dict[str, float]]:
    """The models' parameters by name, M1 to M6, as published for a servo."""
    return dict(yaml.safe_load((Path(__file__).parent / "published.yaml").read_text())[servo]["models"])


def simulated(servo: Servo, runs: Sequence[Run], parameters: Mapping[str, float]) -> list[Array]:
    """Positions [rad] of each run on its own times: semi-implicit Euler from rest at the first measured position."""
    grids = [np.arange(0.0, run.time[-1] + STEP, STEP) for run in runs]
    longest = max(map(len, grids))
    goal = np.stack([
        np.pad(np.interp(grid, run.time, run.command), (0, longest - len(grid)), "edge")
        for run, grid in zip(runs, grids, strict=True)
    ])  # fmt: skip
    p = {**dict.fromkeys(NAMES, 0.0), **UNUSED, **parameters}
    mass, length = np.array([run.load for run in runs]).T
    volts = servo.volts * np.array([run.driven for run in runs])
    back_emf = p["kt"] * np.array([run.driven for run in runs])
    inertia = (mass + servo.rod / 3) * length**2 + p["armature"]
    gains = servo.duty * np.array([run.gain for run in runs])
    offset = p["q_offset"]
    q, v = np.array([run.position[0] for run in runs]) + offset, np.zeros(len(runs))
    path, target = np.empty((len(runs), longest)), goal[:, 0]
    for k in range(longest):
        path[:, k] = q - offset
        target = target + np.clip(goal[:, k] - target, -STEP * p["max_velocity"], STEP * p["max_velocity"])
        duty = np.clip(gains * (target - path[:, k]), -servo.most_duty, servo.most_duty)
        motor = p["kt"] / p["R"] * (volts * duty - back_emf * v)
        load = -(mass + servo.rod / 2) * GRAVITY * length * np.sin(q)
        stop = inertia / STEP * v + motor + load
        limit = friction(p, motor, load, v) + p["friction_viscous"] * np.abs(v)
        v = v + STEP / inertia * (motor + load - np.clip(stop, -limit, limit))
        q = q + STEP * v
    return [np.interp(run.time, grid, row[: len(grid)]) for run, grid, row in zip(runs, grids, path, strict=True)]


NAMES = (
    "q_offset", "friction_base", "friction_stribeck", "friction_viscous", "load_friction_base",
    "load_friction_stribeck", "load_friction_motor", "load_friction_external", "load_friction_motor_stribeck",
    "load_friction_external_stribeck", "load_friction_motor_quad", "load_friction_external_quad",
)  # fmt: skip


def friction(p: Mapping[str, float], motor: Array, load: Array, v: Array) -> Array:
    """Dry friction limit [N m] of motor and load torque [N m] at a speed [rad/s]."""
    sliding = np.exp(-(np.abs(v / p["dtheta_stribeck"]) ** p["alpha"]))
    gear = np.abs(load - motor)
    plain = np.abs(load * p["load_friction_external"] - motor * p["load_friction_motor"])
    slow = np.abs(load * p["load_friction_external_stribeck"] - motor * p["load_friction_motor_stribeck"])
    back_driven = np.abs(load) > np.abs(motor)
    square = np.where(back_driven, p["load_friction_motor_quad"] * motor**2, p["load_friction_external_quad"] * load**2)
    slow = slow + p["friction_stribeck"] + p["load_friction_stribeck"] * gear
    return p["friction_base"] + p["load_friction_base"] * gear + plain + sliding * (slow + (motor * load < 0) * square)
