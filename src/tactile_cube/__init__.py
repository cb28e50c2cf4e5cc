"""Teach a torque-controlled hand to turn an object by touch alone, in a simulation that matches the measured hand.

Each command of the package is also a function of it: `train`, `evaluate`, `compare`, `diagnose`, `identify`, `record`,
`export`, `deploy`, `view`, `monitor` and `effects`; `search_grasps`, `make_env`, `load_policy`, `read_recording` and
`recording_from_arrays` give what they work on. Nothing slow is imported before it is used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import gymnasium

from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from tactile_cube.api.batch import diagnose_each
    from tactile_cube.api.comparison import compare
    from tactile_cube.api.deployment import deploy, export, load_policy
    from tactile_cube.api.diagnosis import diagnose
    from tactile_cube.api.effects import effects
    from tactile_cube.api.environment import env_config, make_env, search_grasps
    from tactile_cube.api.evaluation import evaluate
    from tactile_cube.api.identification import identify
    from tactile_cube.api.monitoring import monitor
    from tactile_cube.api.recording import record
    from tactile_cube.api.training import train
    from tactile_cube.api.view import view
    from tactile_cube.drivetrain.model_file import read_model
    from tactile_cube.measurement.recordings.arrays import TrialArrays, recording_from_arrays
    from tactile_cube.measurement.recordings.reading import read_recording

_PLACES = {
    "compare": "api.comparison",
    "deploy": "api.deployment",
    "diagnose": "api.diagnosis",
    "diagnose_each": "api.batch",
    "effects": "api.effects",
    "env_config": "api.environment",
    "make_env": "api.environment",
    "evaluate": "api.evaluation",
    "export": "api.deployment",
    "load_policy": "api.deployment",
    "identify": "api.identification",
    "search_grasps": "api.environment",
    "monitor": "api.monitoring",
    "record": "api.recording",
    "train": "api.training",
    "view": "api.view",
    "read_model": "drivetrain.model_file",
    "TrialArrays": "measurement.recordings.arrays",
    "recording_from_arrays": "measurement.recordings.arrays",
    "read_recording": "measurement.recordings.reading",
}

__all__ = [
    "InputError",
    "TrialArrays",
    "compare",
    "deploy",
    "diagnose",
    "diagnose_each",
    "effects",
    "env_config",
    "evaluate",
    "export",
    "identify",
    "load_policy",
    "make_env",
    "monitor",
    "read_model",
    "read_recording",
    "record",
    "recording_from_arrays",
    "search_grasps",
    "train",
    "view",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


# Gymnasium 1 loads no entry points of other packages
gymnasium.register(id="tactile_cube/Rotation-v0", entry_point="tactile_cube.gymnasium_env:make_rotation")
