"""Section: gradient updates a second on one core, and how their cost grows."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

import torch
from tensordict import TensorDict

from benchmarks.speed.peers import find_peer
from benchmarks.speed.products import multiplying, update_products
from benchmarks.speed.report import Growth, Section, durations, rates
from benchmarks.speed.sb3_sac import filled_sac
from benchmarks.speed.timing import in_turns
from tactile_cube.agent.agent import Agent
from tactile_cube.agent.networks import Sizes
from tactile_cube.agent.plain_sac import PlainSac
from tactile_cube.agent.sac import Sac
from tactile_cube.training.build import keep_freed_memory
from tactile_cube.training.replay import Replay

SIZES = Sizes(observation=120, privileged=25, action=12)
REWARD_TERMS = 6
YARDSTICK = "Stable-Baselines3 SAC"
BATCHES = (64, 256, 1024, 4096)
WIDTHS = (128, 256, 512, 1024)
REPLAY_SIZES = (10_000, 50_000, 150_000, 500_000)
MEGABYTE = 2**20
CALLS = 20
"""Updates in a row, as in training: the first after something else finds cold caches."""


def update(rounds: int, peers: bool = True, calls: int = CALLS, hidden: int = 512) -> Section:
    """One update with sampling: batch 256, actor and twin critics of two hidden layers, targets, temperature.

    Args:
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
        calls: updates a sample.
        hidden: width of the two hidden layers.
    """
    torch.set_num_threads(1)
    keep_freed_memory()
    section = Section("update", f"one SAC update, batch 256, 2 x {hidden}, sampling included, one thread", YARDSTICK)
    cases = {
        "tactile_cube plain_sac, bf16": _updating(PlainSac(SIZES, precision="bf16", hidden=(hidden, hidden))),
        "tactile_cube plain_sac, fp32": _updating(PlainSac(SIZES, precision="fp32", hidden=(hidden, hidden))),
        "TorchRL SACLoss (agent=sac)": _updating(Sac(SIZES, hidden=(hidden, hidden))),
        "TorchRL SACLoss (agent=sac), bf16": _updating(Sac(SIZES, precision="bf16", hidden=(hidden, hidden))),
    }
    sb3 = find_peer("stable_baselines3", section.missing) if peers else None
    if sb3 is not None:
        cases[YARDSTICK] = _peer(sb3, hidden)
    parts = _parts(hidden)
    timings = in_turns(cases | parts, rounds, calls)
    section.figures = rates({name: timings[name] for name in cases}, YARDSTICK, "updates/s")
    section.figures += durations({name: timings[name] for name in parts})
    section.growth = [*_growth(max(rounds // 2, 1), hidden), _replay_memory()]
    return section


def _parts(hidden: int) -> dict[str, Callable[[], object]]:
    """Indispensable parts of an update: a lower bound for every implementation."""
    replay, weights = filled_replay(20_000), torch.ones(REWARD_TERMS)
    shapes = update_products(SIZES, 256, hidden)
    return {
        "sampling": lambda: replay.sample(256, weights),
        "limit: matrix products alone, bf16": multiplying(shapes, torch.bfloat16),
        "limit: matrix products alone, fp32": multiplying(shapes, torch.float32),
    }


def _updating(agent: Agent, batch: int = 256) -> Callable[[], object]:
    replay = filled_replay(20_000)
    weights = torch.ones(REWARD_TERMS)
    return lambda: agent.update(replay.sample(batch, weights))


def filled_replay(capacity: int) -> Replay:
    """A full replay of made-up transitions."""
    replay = Replay(capacity, SIZES, REWARD_TERMS, seed=0)
    parts = {key: torch.rand(capacity, width) * 2.0 - 1.0 for key, width in replay.widths.items()}
    parts |= {("next", "terminated"): torch.zeros(capacity, 1), "steps_to_next_obs": torch.ones(capacity, 1)}
    replay.extend(TensorDict(parts, [capacity]))
    return replay


def _peer(sb3: ModuleType, hidden: int) -> Callable[[], Any]:
    model = filled_sac(sb3, SIZES.observation, SIZES.action, hidden)
    return partial(model.train, 1, 256)


def _growth(rounds: int, hidden: int) -> list[Growth]:
    by_batch = {str(n): _updating(_plain(hidden), n) for n in BATCHES}
    by_width = {str(n): _updating(_plain(n)) for n in WIDTHS}
    return [
        _curve("update time against batch", "batch", by_batch, rounds),
        _curve("update time against width", "width of two hidden layers", by_width, rounds),
    ]


def _plain(hidden: int) -> PlainSac:
    return PlainSac(SIZES, precision="bf16", hidden=(hidden, hidden))


def _curve(name: str, x_name: str, cases: dict[str, Callable[[], object]], rounds: int) -> Growth:
    timings = in_turns(cases, rounds, 1)
    milliseconds = [timing.quartiles[1] * 1e3 for timing in timings.values()]
    return Growth(name, x_name, [float(n) for n in cases], "CPU time an update [ms]", milliseconds)


def _replay_memory() -> Growth:
    width = sum(Replay(1, SIZES, REWARD_TERMS, seed=0).widths.values())
    memory = [4 * n * width / MEGABYTE for n in REPLAY_SIZES]
    return Growth("memory against replay size", "transitions", [float(n) for n in REPLAY_SIZES], "replay [MiB]", memory)
