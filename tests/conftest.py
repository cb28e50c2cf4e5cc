"""Files that take long begin first; a world without physics, for tests of what surrounds the world."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactile_cube.env import Reward, RotationEnv, Task
from tactile_cube.hand import DLR_HAND2
from tactile_cube.randomization import Randomization, StartStates
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start

LONG = ("test_browser", "test_train_command", "test_circle", "test_results_are_whole", "test_measurement_commands",
        "test_recovery", "test_background", "test_readers", "test_judge", "test_state")  # fmt: skip
"""By their stems; one of them at the end would keep one processor busy and leave the others idle."""


def pytest_configure() -> None:
    os.environ["OMP_NUM_THREADS"] = "1"  # of each process of the tests and what it starts: there is one a core already


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: LONG.index(item.path.stem) if item.path.stem in LONG else len(LONG))


class ScriptedWorld:
    """The joints go halfway to their targets; the cube turns by `turn` [rad] and moves by `shift` [m] a step."""

    def __init__(self, turn: float = 0.05, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self.options = SimulationOptions()
        self.turn, self.shift, self.healthy = turn, np.array(shift), True
        self.commands: list[Any] = []

    def reset(self, constants: EpisodeConstants, start: Start) -> None:
        self.constants, self.start, self.healthy = constants, start, True
        self.q = self.q_f = np.array(start.angles)
        self.cube_position = np.array(start.cube_position)
        self.cube_quaternion = np.array(start.cube_quaternion)
        self.cube_linear_velocity = self.cube_angular_velocity = np.zeros(3)
        self.yaw = 2.0 * math.atan2(self.cube_quaternion[2], self.cube_quaternion[3])

    @property
    def q_m(self) -> Any:
        return self.q + 0.01

    def normal_forces(self) -> Any:
        return np.zeros((2, 4))

    def step(self, q_n: Any) -> None:
        self.commands.append(np.array(q_n))
        self.q_f = self.q_f + 0.5 * (q_n - self.q_f)
        self.q = self.q + 0.5 * (self.q_f - self.q)
        self.yaw += self.turn
        self.cube_quaternion = np.array([0.0, 0.0, math.sin(0.5 * self.yaw), math.cos(0.5 * self.yaw)])
        self.cube_position = self.cube_position + self.shift


@pytest.fixture
def scripted_world() -> type[ScriptedWorld]:
    return ScriptedWorld


@pytest.fixture
def rotation_task() -> Callable[..., RotationEnv]:
    """Makes a RotationEnv in a scripted world; keywords replace its parts."""

    def make(world: ScriptedWorld | None = None, **parts: Any) -> RotationEnv:
        settings: dict[str, Any] = {
            "task": Task("full", direction=1),
            "reward": Reward(),
            "randomization": Randomization(),
            "start": StartStates().of(DLR_HAND2),
        } | parts
        return RotationEnv(world or ScriptedWorld(), **settings)  # type: ignore[arg-type]

    return make
