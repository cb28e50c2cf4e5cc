"""Search for a scripted gait: the demonstrations that the default recipe learns from."""

from __future__ import annotations

import dataclasses
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cma
import numpy as np
import yaml

from tactile_cube.agent.policy_file import current_commit
from tactile_cube.env import RotationEnv
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand import Gait
from tactile_cube.training.ledger import Costs

BOUNDS = {
    "swing": (0.3, 1.1),
    "shift": (-0.5, 0.5),
    "period": (20.0, 80.0),
    "air_share": (0.1, 0.45),
    "pressed": (0.038, 0.052),
    "lifted": (0.07, 0.105),
    "height": (-0.01, 0.02),
}
"""Range of each number of a gait, in its own unit; what the fingers reach and the faces' distance set them."""


@dataclass(frozen=True)
class Trial:
    """Performance of a gait.

    Attributes:
        gait: what was tried.
        angle: mean final angle [rad].
        kept: share of the episodes that kept the object to the end.
        score: mean over the episodes of the final angle [rad]; where the object was lost, half of it, times the share
            of the time until then: a regrasp before a drop is worth something, one that holds much more.
        steps: environment steps of the episodes.
    """

    gait: Gait
    angle: float
    kept: float
    score: float
    steps: int


@dataclass(frozen=True)
class Found:
    """Result of a search.

    Attributes:
        best: the gait with the best score when tried again in fresh episodes.
        elite: the best quarter of the last generations' gaits, best first.
        tried: number of gaits tried.
        steps: environment steps of the search.
    """

    best: Trial
    elite: list[Trial]
    tried: int
    steps: int


def search_gait(
    worlds: Sequence[RotationEnv],
    generations: int,
    population: int,
    seed: int,
    say: Callable[[str], None] = print,
    book: Callable[[int], None] = lambda steps: None,
) -> Found:
    """Search by CMA-ES, beginning at the gait that is known.

    Args:
        worlds: environments, one episode of each a gait; a generation's gaits see the same episodes.
        generations: of the search.
        population: gaits a generation.
        seed: of the search and of the episodes.
        say: takes a line a generation.
        book: takes the environment steps so far, after each generation and at the end.
    """
    options = {"seed": seed + 1, "popsize": population, "verbose": -9, "maxiter": generations}
    strategy = cma.CMAEvolutionStrategy(_numbers(Gait().of(worlds[0].hand)), 0.15, options)
    trials: list[Trial] = []
    for generation in range(generations):
        asked = strategy.ask()
        tried = [try_gait(worlds, _gait(numbers), seed + generation) for numbers in asked]
        strategy.tell(asked, [-trial.score for trial in tried])
        trials += tried
        best = max(tried, key=lambda trial: trial.score)
        say(f"generation {generation + 1}: best {best.score:.2f}, {best.angle:.2f} rad, kept {best.kept:.0%}")
        book(sum(trial.steps for trial in trials))
    recent = trials[-max(4, len(trials) // 2) :]
    elite = sorted(recent, key=lambda trial: -trial.score)[: max(1, len(recent) // 4)]
    fresh = [try_gait(worlds, trial.gait, seed + 1000) for trial in elite[:5]]
    best = max(fresh, key=lambda trial: trial.score)
    steps = sum(trial.steps for trial in (*trials, *fresh))
    book(steps)
    return Found(best, elite, len(trials) + len(fresh), steps)


def try_gait(worlds: Sequence[RotationEnv], gait: Gait, seed: int) -> Trial:
    """Play a gait for one episode in each world."""
    task, hand = worlds[0].task, worlds[0].hand
    actions = gait.actions(hand, task.episode_steps, task.direction)
    angles, shares, steps = zip(*(_play(env, actions, seed, index) for index, env in enumerate(worlds)), strict=True)
    lost = np.array(shares) < 1.0
    score = float(np.mean(np.array(angles) * np.where(lost, 0.5 * np.array(shares), 1.0)))
    return Trial(gait, float(np.mean(angles)), float(np.mean(np.array(shares) == 1.0)), score, sum(steps))


def _play(env: RotationEnv, actions: Array, seed: int, index: int) -> tuple[float, float, int]:
    """Final angle [rad], the share of the episode's time for which the object was kept, and its steps."""
    env.seed(seed, index)
    moment = env.reset()
    while not (moment.terminated or moment.truncated):
        moment = env.step(actions[moment.step])
    share = moment.step / env.task.episode_steps if moment.terminated else 1.0
    return moment.theta, share, moment.step


def _numbers(gait: Gait) -> Array:
    """A gait as numbers in the middle of [0, 1]."""
    inside = [(getattr(gait, name) - low) / (high - low) for name, (low, high) in BOUNDS.items()]
    return np.array([*inside, *gait.phases[1:]])


def _gait(numbers: Array) -> Gait:
    """The gait of numbers; those outside [0, 1] are reflected, phases go round."""
    folded = 1.0 - np.abs(1.0 - np.asarray(numbers)[: len(BOUNDS)] % 2.0)
    values = {
        name: float(low + (high - low) * x) for (name, (low, high)), x in zip(BOUNDS.items(), folded, strict=True)
    }
    phases = (0.0, *(float(x % 1.0) for x in numbers[len(BOUNDS) :]))
    period = round(values.pop("period"))
    return Gait(**values, period=period, phases=phases)  # type: ignore[arg-type]


def write_gait(path: Path, found: Found, seed: int, costs: Costs) -> None:
    """Write the best gait, the ranges of the elite around it and what the search cost, as YAML.

    Gaits of the elite whose fingers take turns as the best one's do give the ranges. These say what the search cost,
    so that the policies which they teach count it.
    """
    alike = [trial.gait for trial in found.elite if _turns_taken(trial.gait) == _turns_taken(found.best.gait)]
    rows = {name: [float(getattr(gait, name)) for gait in [*alike, found.best.gait]] for name in BOUNDS}
    data = {
        "gaits": {
            "_target_": "tactile_cube.hand.gait.GaitRanges",
            "low": {name: round(min(row), 4) for name, row in rows.items()},
            "high": {name: round(max(row), 4) for name, row in rows.items()},
            "phases": [round(phase, 3) for phase in found.best.gait.phases],
            "search": {
                "name": path.parent.name,
                "steps": found.steps,
                "cpu_hours": round((costs.simulating + costs.learning) / 3600, 4),
                "wall_hours": round(costs.wall / 3600, 4),
                "commit": current_commit(),
            },
        },
        "best": {**dataclasses.asdict(found.best.gait), "phases": list(found.best.gait.phases)},
        "angle": found.best.angle,
        "kept": found.best.kept,
        "gaits_tried": found.tried,
        "seed": seed,
        "command": shlex.join(["python", "-m", "benchmarks.gait", *sys.argv[1:]]),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(data, sort_keys=False))


def _turns_taken(gait: Gait) -> tuple[int, ...]:
    """Order in which the fingers go back."""
    return tuple(int(finger) for finger in np.argsort(np.array(gait.phases)))
