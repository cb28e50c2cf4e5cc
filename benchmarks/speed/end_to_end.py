"""Section: whole iterations of learning, simulation and updates together."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.speed.peers import find_peer
from benchmarks.speed.report import Figure, Section
from benchmarks.speed.sb3_sac import learning_sac
from benchmarks.speed.timing import Timing, in_turns
from tactile_cube.agent.agent import Agent
from tactile_cube.agent.plain_sac import PlainSac
from tactile_cube.agent.sac import Sac
from tactile_cube.gymnasium_env import GymnasiumRotation
from tactile_cube.simulation.engine import EngineName
from tactile_cube.training.build import Environment, build_run, rotation_environment
from tactile_cube.training.run import Run
from tactile_cube.training.settings import CollectorSettings, TrainingSettings
from tactile_cube.transforms import EnvConfig

WORLDS, STEPS, UPDATES, HIDDEN = 12, 25, 100, 512
YARDSTICK = "Stable-Baselines3 SAC"


def end_to_end(
    rounds: int,
    peers: bool = True,
    worlds: int = WORLDS,
    steps: int = STEPS,
    updates: int = UPDATES,
    hidden: int = HIDDEN,
) -> Section:
    """Iterations at the paper's ratio: 12 worlds x 25 steps and 100 updates of batch 256.

    Args:
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
        worlds: worlds in all.
        steps: steps a world and iteration.
        updates: updates an iteration.
        hidden: width of the two hidden layers.
    """
    frames = worlds * steps
    title = f"table task, {frames} environment steps and {updates} updates of batch 256 an iteration"
    section = Section("end_to_end", title, YARDSTICK)
    bullet, fast = table_environment(), partial(PlainSac, precision="bf16")
    learners: dict[str, tuple[Environment, Callable[..., Agent]]] = {
        "tactile_cube, plain_sac bf16": (bullet, fast),
        "tactile_cube, plain_sac bf16, engine=mujoco": (table_environment("mujoco"), fast),
        "tactile_cube, SACLoss": (bullet, Sac),
    }
    with ExitStack() as stack:
        cases: dict[str, Callable[[], object]] = {}
        workers: dict[str, Callable[[], float]] = {}
        for name, (environment, make) in learners.items():
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            run = _run(environment, partial(make, hidden=(hidden, hidden)), folder, worlds, steps, updates)
            stack.callback(run.close)
            cases[name], workers[name] = run.learner.iterate, run.learner.collection.cpu_seconds
        sb3 = find_peer("stable_baselines3", section.missing) if peers else None
        if sb3 is not None:
            cases[YARDSTICK] = _peer(sb3, worlds, steps, updates, hidden)
        before = {name: seconds() for name, seconds in workers.items()}
        timings = in_turns(cases, rounds, 1)
        # workers were also busy in the uncounted first call
        simulating = {name: (seconds() - before[name]) / (rounds + 1) for name, seconds in workers.items()}
    section.figures = _figures(timings, simulating, frames)
    return section


def _run(
    environment: Environment,
    make_agent: Callable[..., Agent],
    folder: Path,
    worlds: int,
    steps: int,
    updates: int,
) -> Run:
    run = build_run(
        folder=folder,
        seed=0,
        environment=environment,
        make_agent=make_agent,
        collector=CollectorSettings(worlds=worlds),
        training=TrainingSettings(
            steps_per_iteration=steps,
            updates_per_iteration=updates,
            learning_starts=worlds,
            random_steps=0,
            replay_size=20_000,
        ),
        config={},
    )
    run.learner.collection.restart(0, (0, 0.0))
    run.learner.iterate()  # fills the replay
    return run


def _peer(sb3: ModuleType, worlds: int, steps: int, updates: int, hidden: int) -> Callable[[], object]:
    config = table_config()
    model = learning_sac(sb3, lambda: GymnasiumRotation(config, judged=False), worlds, hidden, steps, updates)
    return lambda: model.learn(worlds * steps, reset_num_timesteps=False)


def _figures(timings: dict[str, Timing], simulating: dict[str, float], frames: int) -> list[Figure]:
    """Steps a second on the clock and core-seconds a thousand steps, with ratios to the yardstick."""
    base_wall = np.median(timings[YARDSTICK].wall) if YARDSTICK in timings else None
    base_cpu = np.median(timings[YARDSTICK].cpu) if YARDSTICK in timings else None
    figures = []
    for name, timing in timings.items():
        fast, median, slow = (float(frames / seconds) for seconds in np.quantile(timing.wall, [0.25, 0.5, 0.75]))
        ratio = None if base_wall is None else float(base_wall / frames * median)
        figures.append(Figure(name, median, slow, fast, "steps/s on the clock", ratio))
    for name, timing in timings.items():
        extra = simulating.get(name, 0.0)
        quartiles = np.quantile(timing.cpu, [0.25, 0.5, 0.75]) + extra
        low, median, high = (float(seconds / frames * 1000.0) for seconds in quartiles)
        ratio = None if base_cpu is None else float(base_cpu / frames * 1000.0 / median)
        figures.append(Figure(name, median, low, high, "core-seconds / 1000 steps", ratio))
    return figures


def table_config() -> EnvConfig:
    """The configuration of the experiment, composed as on the command line."""
    from hydra import compose, initialize_config_dir
    from hydra.core.global_hydra import GlobalHydra
    from hydra.utils import instantiate

    from tactile_cube.composition import CONFIG

    GlobalHydra.instance().clear()  # of the command that runs this, which has its configuration already
    with initialize_config_dir(str(CONFIG.resolve()), version_base="1.3"):
        config: EnvConfig = instantiate(compose("train", overrides=["+experiment=table"]).env)
    return config


def table_environment(engine: EngineName = "bullet") -> Environment:
    """The same, as training takes it."""
    config = table_config()
    return rotation_environment(replace(config, simulation=replace(config.simulation, engine=engine)))
