"""How a policy does while it learns: without exploration, in worlds that stay the same all through a training."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torchrl.envs import TransformedEnv

from tactile_cube.agent.networks import Actor
from tactile_cube.env.reward import SUPPORTING_TIPS, TOUCH_FORCE
from tactile_cube.env.task import TIME_LIMIT
from tactile_cube.errors import InputError
from tactile_cube.transforms import EnvConfig, make_env

ENGINES = ("bullet", "mujoco")
SEED = 20_264
"""Of the trials' worlds; those of a judgement (conf/experiment) and of trainings are others."""
MEASURED = ("return", "held", "angle", "drift", "tips", "links", "link_force")
"""Means over the episodes: sum of rewards; share that is not lost; final angle [rad]; tips: share of the time in which
three fingertips or more touch the object, links: in which another link does; link_force: these links' share of force.
drift: median change of the object's height [mm/s], below 0 where it sinks."""
SCORE = "score"
"""Mean over engines and episodes of the final angle [rad], 0 where the object is lost."""
KEYS = ("done", "reward", "theta", "outcome")
Array = NDArray[np.float64]


@dataclass
class Trial:
    """Tries actors in the worlds of a configuration, in both engines under its own conditions.

    Attributes:
        config: what the worlds are drawn from.
        left_out: why an engine is left out, by its name.
    """

    config: EnvConfig
    left_out: dict[str, str] = field(default_factory=dict)
    _worlds: dict[str, TransformedEnv] = field(default_factory=dict)

    def __call__(self, actor: Actor, episodes: int) -> dict[str, float]:
        """`SCORE`, and what is `MEASURED` by `<engine>_<name>`; leaves torch's generator as it was."""
        result: dict[str, float] = {}
        scores = []
        with torch.random.fork_rng(devices=[]), torch.no_grad():
            for engine in ENGINES:
                env = self._made(engine, episodes)
                if env is not None:
                    measured, score = _tried(env, actor, self.config)
                    scores.append(score)
                    result |= {f"{engine}_{name}": value for name, value in measured.items()}
        return result | {SCORE: float(np.mean(scores))} if scores else {}

    def _made(self, engine: Any, episodes: int) -> TransformedEnv | None:
        """The worlds of an engine, made once; None where it cannot have them."""
        if engine not in self._worlds and engine not in self.left_out:
            try:
                config = replace(self.config, simulation=replace(self.config.simulation, engine=engine))
                self._worlds[engine] = make_env(config, episodes, SEED, evaluation=True)
            except InputError as error:
                self.left_out[engine] = str(error)
        return self._worlds.get(engine)


def _tried(env: TransformedEnv, actor: Actor, config: EnvConfig) -> tuple[dict[str, float], float]:
    """One episode in each world."""
    env.set_seed(SEED)
    state = env.reset()
    worlds = [task.world for task in env.base_env.tasks]
    heights, forces, rows = list[list[float]](), list[list[Array]](), list[Array]()
    for _ in range(config.task.episode_steps):
        heights.append([world.cube_position[2] for world in worlds])
        forces.append([world.normal_forces() for world in worlds])
        state["action"] = actor.deterministic(state["observation"])
        step, state = env.step_and_maybe_reset(state)
        rows.append(np.stack([step["next", key][:, 0].double().numpy() for key in KEYS]))
    ended, reward, theta, outcome = np.array(rows).swapaxes(0, 1)  # each (steps, worlds)
    last = np.argmax(ended, axis=0)  # which all come to: the time limit ends an episode
    own = np.arange(len(rows))[:, None] <= last  # what comes after is another episode
    height, force = np.array(heights), np.array(forces)
    each = np.arange(len(worlds))
    angle, held = theta[last, each], outcome[last, each] == TIME_LIMIT
    seconds = np.maximum(last, 1) * config.simulation.policy_dt
    links, tips = np.moveaxis(force, 2, 0)  # each (steps, worlds, fingers)
    measured = {
        "return": float((reward * own).sum(0).mean()),
        "held": float(held.mean()),
        "angle": float(angle.mean()),
        "drift": float(np.median(1e3 * (height[last, each] - height[0]) / seconds)),
        "tips": float(((tips > TOUCH_FORCE).sum(-1) >= SUPPORTING_TIPS)[own].mean()),
        "links": float((links > TOUCH_FORCE).any(-1)[own].mean()),
        "link_force": float(links[own].sum() / max(force[own].sum(), 1e-9)),
    }
    return measured, float((angle * held).mean())
