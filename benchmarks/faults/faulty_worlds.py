"""The rotation task whose worlds raise, or give NaN, once when a file asks for it."""

import dataclasses
import os
from functools import partial
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDictBase
from torchrl.envs import EnvBase, Transform

from tactile_cube.training.build import Environment, rotation_environment
from tactile_cube.training.collection import MakeEnv
from tactile_cube.transforms import EnvConfig

WISH = "TACTILE_CUBE_TEST_WISH"
"""Environment variable that names the file; it holds "raise" or "nan"."""


class Wish(Transform):  # type: ignore[misc]
    """Causes the fault that the file asks for, and deletes the file."""

    def __init__(self, path: Path):
        super().__init__()
        self._path = path

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        try:
            wish = self._path.read_text()
            self._path.unlink()  # one worker is granted it, whichever is first
        except OSError:
            return next_tensordict
        if wish == "raise":
            raise RuntimeError("this world was asked to fail")
        next_tensordict["observation"].view(-1)[0] = torch.nan
        return next_tensordict


def faulty_environment(**settings: Any) -> Environment:
    """As `tactile_cube.transforms.EnvConfig` would make it, with wishes."""
    environment = rotation_environment(EnvConfig(**settings))
    return dataclasses.replace(environment, make=partial(_make, environment.make, Path(os.environ[WISH])))


def _make(make: MakeEnv, wish: Path, worlds: int, seed: int) -> EnvBase:
    env = make(worlds=worlds, seed=seed)
    env.append_transform(Wish(wish))
    return env
