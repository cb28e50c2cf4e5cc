"""What training needs to know about an environment besides how to make one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
from torch import Tensor

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.env import OUTCOMES, Conditions
from tactile_cube.env.rotation import OBJECT
from tactile_cube.randomization import Learnability
from tactile_cube.training.collection import MakeEnv
from tactile_cube.training.trial import Trial
from tactile_cube.transforms import EnvConfig, make_env


@dataclass(frozen=True)
class Environment:
    """A family of equal worlds.

    Attributes:
        make: makes a batch of worlds, in whichever process.
        sizes: widths of observation, privileged state and action.
        terms: names of the reward terms, in the order of "reward_terms".
        reward_weights: weights of the terms (terms,) under the conditions in force.
        outcomes: names of the codes in the key "outcome".
        learnability: makes what keeps account of the worlds; None: nothing does.
        trial: tries an actor in so many episodes an engine, see `Trial`; None: nothing does.
        approximations: what its worlds compute less well than they could, in words.
    """

    make: MakeEnv
    sizes: Sizes
    terms: tuple[str, ...]
    reward_weights: Callable[[Conditions], Tensor]
    outcomes: tuple[str, ...] = ()
    learnability: Callable[[], Learnability] | None = None
    trial: Callable[[Actor, int], dict[str, float]] | None = None
    approximations: tuple[str, ...] = ()


def rotation_environment(config: EnvConfig) -> Environment:
    """The rotation task as configured."""
    joints = config.hand.joints
    return Environment(
        make=partial(make_env, config),
        sizes=Sizes(2 * joints * config.stack, OBJECT + joints, joints),
        terms=config.reward.terms,
        reward_weights=partial(_weights, config),
        outcomes=OUTCOMES,
        learnability=partial(config.randomization.learnability, config.constants),
        trial=Trial(config),
        approximations=tuple(config.approximations()),
    )


def _weights(config: EnvConfig, conditions: Conditions) -> Tensor:
    return torch.from_numpy(config.reward.weights(conditions.penalty_scale))


def as_environment(made: Any) -> Environment:
    """What `env` in the configuration stands for: an environment, or the rotation task's configuration."""
    return made if isinstance(made, Environment) else rotation_environment(made)
