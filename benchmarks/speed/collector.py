"""Section: environment steps with transforms, policy and TorchRL's collector around the worlds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.speed.report import Growth, Section, rates
from benchmarks.speed.the_task import table_config, table_environment
from benchmarks.speed.timing import in_turns
from tactile_cube.agent.agent import AgentSettings
from tactile_cube.agent.networks import Actor
from tactile_cube.gymnasium_env import GymnasiumRotation
from tactile_cube.training.build import Environment
from tactile_cube.training.collection import Collection, MultiSyncCollection, SingleCollection
from tactile_cube.training.settings import CollectorSettings
from tactile_cube.transforms.make_env import rotation_env

YARDSTICK = "the bare task, one world"
WORLDS = (1, 2, 4, 8, 12)
PROCESSES = (1, 2, 3, 4, 6, 12)
STEPS = 10
TIMEOUT = 300.0
PROGRESS = (0, 0.0)


def collector(
    rounds: int, worlds: tuple[int, ...] = WORLDS, processes: tuple[int, ...] = PROCESSES, steps: int = STEPS
) -> Section:
    """Environment steps a second of processor time in one process, and on the clock in several.

    Args:
        rounds: samples a figure.
        worlds: numbers of worlds in one process.
        processes: numbers of processes that share the largest number of worlds.
        steps: steps a world and sample.
    """
    torch.set_num_threads(1)
    section = Section("collector", "environment steps on the table task, untrained policy", YARDSTICK)
    environment = table_environment()
    with ExitStack() as stack:
        cases: dict[str, Callable[[], object]] = {YARDSTICK: _bare(steps), "Gymnasium, one world": _gymnasium(steps)}
        scale = dict.fromkeys(cases, steps)
        for n in worlds:
            name = f"TorchRL collector, {n} world{'s' if n > 1 else ''}"
            collection = SingleCollection(environment.make, actor_of(environment), CollectorSettings(worlds=n), steps)
            stack.callback(collection.close)
            cases[name], scale[name] = collecting(collection, environment), n * steps
        timings = in_turns(cases, rounds, 1)
    for name, timing in timings.items():
        timing.cpu = [seconds / scale[name] for seconds in timing.cpu]
        timing.wall = [seconds / scale[name] for seconds in timing.wall]
    section.figures = rates(timings, YARDSTICK, "steps/s")
    hosted = [figure.value for figure in section.figures[-len(worlds) :]]
    section.growth = [
        Growth("steps against worlds in one process", "worlds", [float(n) for n in worlds], "steps/s of CPU", hosted),
        _processes(environment, rounds, worlds[-1], processes, steps),
    ]
    return section


def _processes(environment: Environment, rounds: int, worlds: int, processes: tuple[int, ...], steps: int) -> Growth:
    speeds = []
    for n in processes:
        actor = actor_of(environment)
        settings = CollectorSettings(worlds=worlds, processes=n, timeout=TIMEOUT)
        collection = MultiSyncCollection(environment.make, actor, settings, steps)
        try:
            timing = in_turns({"": collecting(collection, environment)}, rounds, 1)[""]
        finally:
            collection.close()
        speeds.append(worlds * steps / sorted(timing.wall)[rounds // 2])
    name = f"steps of {worlds} worlds against processes"
    return Growth(name, "processes", [float(n) for n in processes], "steps/s on the clock", speeds)


def actor_of(environment: Environment) -> Actor:
    """An untrained actor of the usual size."""
    torch.manual_seed(0)
    return Actor(environment.sizes, AgentSettings().hidden)


def collecting(collection: Collection, environment: Environment) -> Callable[[], object]:
    """A call that collects one block."""
    actor = actor_of(environment)
    collection.restart(0, PROGRESS)

    def collect() -> object:
        collection.launch(actor, False, PROGRESS)
        return collection.take()

    return collect


def _bare(steps: int) -> Callable[[], None]:
    task = rotation_env(table_config())
    task.reset()
    actions = _actions()

    def run() -> None:
        for _ in range(steps):
            moment = task.step(next(actions).astype(np.float64))
            if moment.terminated or moment.truncated:
                task.reset()

    return run


def _gymnasium(steps: int) -> Callable[[], None]:
    env = GymnasiumRotation(table_config(), judged=False)
    env.reset(seed=0)
    actions = _actions()

    def run() -> None:
        for _ in range(steps):
            *_, terminated, truncated, _ = env.step(next(actions))
            if terminated or truncated:
                env.reset()

    return run


def _actions() -> Iterator[NDArray[np.float32]]:
    """What an untrained policy does: tanh of N(0, 0.22) in each joint."""
    rng = np.random.default_rng(0)
    while True:
        yield np.tanh(0.22 * rng.standard_normal(12)).astype(np.float32)
