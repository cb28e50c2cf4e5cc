"""Scripted worlds under transforms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from torchrl.envs import TransformedEnv
from torchrl.envs.transforms import Transform

from tactile_cube.env import RotationEnv
from tactile_cube.env.worlds import WorldsEnv


@pytest.fixture
def transformed(scripted_world: Any, rotation_task: Callable[..., RotationEnv]) -> Callable[..., TransformedEnv]:
    """Makes an environment of `worlds` scripted worlds under one transform."""

    def make(transform: Transform, worlds: int = 2, seed: int = 0) -> TransformedEnv:
        env = TransformedEnv(WorldsEnv([rotation_task(scripted_world()) for _ in range(worlds)]), transform)
        env.set_seed(seed)
        return env

    return make
