"""Teach a torque-controlled hand to turn an object by touch alone, in a simulation that matches the measured hand.

Each command but `workbench` is a function too, of the same keywords: `train`, `average`, `evaluate`, `compare`,
`diagnose`, `identify`, `record`, `export`, `export_model`, `deploy`, `view`, `monitor` and `effects`; `env_config`,
`search_grasps`, `make_env`, `load_policy`, `read_recording` and `recording_from_arrays` give what they work on. Nothing
slow is imported before it is used.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

import gymnasium

from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from tactile_cube.api.comparison import compare as compare
    from tactile_cube.api.comparison import record as record
    from tactile_cube.api.deployment import deploy as deploy
    from tactile_cube.api.deployment import export as export
    from tactile_cube.api.deployment import load_policy as load_policy
    from tactile_cube.api.diagnosis import diagnose as diagnose
    from tactile_cube.api.diagnosis import diagnose_each as diagnose_each
    from tactile_cube.api.effects import effects as effects
    from tactile_cube.api.environment import env_config as env_config
    from tactile_cube.api.environment import make_env as make_env
    from tactile_cube.api.environment import search_grasps as search_grasps
    from tactile_cube.api.evaluation import evaluate as evaluate
    from tactile_cube.api.evaluation import view as view
    from tactile_cube.api.identification import export_model as export_model
    from tactile_cube.api.identification import identify as identify
    from tactile_cube.api.monitoring import monitor as monitor
    from tactile_cube.api.training import average as average
    from tactile_cube.api.training import train as train
    from tactile_cube.drivetrain.model_file import read_model as read_model
    from tactile_cube.measurement.recordings.arrays import TrialArrays as TrialArrays
    from tactile_cube.measurement.recordings.arrays import recording_from_arrays as recording_from_arrays
    from tactile_cube.measurement.recordings.reading import read_recording as read_recording

_PLACES = {
    "api.comparison": "compare record",
    "api.deployment": "deploy export load_policy",
    "api.diagnosis": "diagnose diagnose_each",
    "api.effects": "effects",
    "api.environment": "env_config make_env search_grasps",
    "api.evaluation": "evaluate view",
    "api.identification": "export_model identify",
    "api.monitoring": "monitor",
    "api.training": "average train",
    "drivetrain.model_file": "read_model",
    "measurement.recordings.arrays": "TrialArrays recording_from_arrays",
    "measurement.recordings.reading": "read_recording",
}
"""Module -> what the package takes from it, as for type checkers above."""
_MODULES = {name: module for module, names in _PLACES.items() for name in names.split()}
__all__ = ["InputError", *_MODULES]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
    return globals()[name]


class _Package(ModuleType):
    """Keeps its functions: importing a command's module, as `tactile_cube.train`, does not hide `train`."""

    def __setattr__(self, name: str, value: object) -> None:
        if name not in __all__ or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

# Gymnasium 1 loads no entry points of other packages
gymnasium.register(id="tactile_cube/Rotation-v0", entry_point="tactile_cube.gymnasium_env:make_rotation")
