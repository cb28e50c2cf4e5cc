"""Teach a torque-controlled hand to turn an object by touch alone, in a simulation that matches the measured hand.

Each command but `workbench` is a function too, of the same keywords: `train`, `average`, `evaluate`, `compare`,
`diagnose`, `identify`, `record`, `export`, `export_model`, `deploy`, `view`, `monitor` and `effects`; `env_config`,
`search_grasps`, `make_env`, `load_policy`, `read_recording` and `recording_from_arrays` give what they work on. Nothing
slow is imported before it is used.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
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
    from tactile_cube.api.model_export import export_model
    from tactile_cube.api.monitoring import monitor
    from tactile_cube.api.recording import record
    from tactile_cube.api.training import average, train
    from tactile_cube.api.view import view
    from tactile_cube.drivetrain.model_file import read_model
    from tactile_cube.measurement.recordings.arrays import TrialArrays, recording_from_arrays
    from tactile_cube.measurement.recordings.reading import read_recording

_PLACES = {
    "api.batch": ["diagnose_each"],
    "api.comparison": ["compare"],
    "api.deployment": ["deploy", "export", "load_policy"],
    "api.model_export": ["export_model"],
    "api.diagnosis": ["diagnose"],
    "api.effects": ["effects"],
    "api.environment": ["env_config", "make_env", "search_grasps"],
    "api.evaluation": ["evaluate"],
    "api.identification": ["identify"],
    "api.monitoring": ["monitor"],
    "api.recording": ["record"],
    "api.training": ["average", "train"],
    "api.view": ["view"],
    "drivetrain.model_file": ["read_model"],
    "measurement.recordings.arrays": ["TrialArrays", "recording_from_arrays"],
    "measurement.recordings.reading": ["read_recording"],
}
"""Module -> what the package takes from it, as for type checkers above."""
__all__ = [
    "InputError",
    "TrialArrays",
    "average",
    "compare",
    "deploy",
    "diagnose",
    "diagnose_each",
    "effects",
    "env_config",
    "evaluate",
    "export",
    "export_model",
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
    for module, names in _PLACES.items():
        if name in names:
            globals()[name] = getattr(importlib.import_module(f"{__name__}.{module}"), name)
            return globals()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


class _Package(ModuleType):
    """Keeps its functions: importing a command's module, as `tactile_cube.train`, does not hide `train`."""

    def __setattr__(self, name: str, value: object) -> None:
        if name not in __all__ or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

# Gymnasium 1 loads no entry points of other packages
gymnasium.register(id="tactile_cube/Rotation-v0", entry_point="tactile_cube.gymnasium_env:make_rotation")
