"""What training needs to know about an environment besides how to make one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
from torch import Tensor

from tactile_cube.agent.networks import Sizes
from tactile_cube.env import OUTCOMES, Conditions
from tactile_cube.env.rotation import OBJECT
from tactile_cube.randomization import Learnability
from tactile_cube.training.collection import MakeEnv
from tactile_cube.transforms import EnvConfig, make_env


@dataclass(frozen=True)
class Environment:
    """A family of equal worlds.

    Attributes:
        make: makes a batch of worlds, in whichever process.
        sizes: widths of observation, privileged state and action.
        reward_terms: number of reward terms.
        reward_weights: weights of the terms (terms,) under the conditions in force.
        outcomes: names of the codes in the key "outcome".
        logged_terms: names of the last reward terms, whose means the training curves show.
        learnability: makes what keeps account of the worlds; None: nothing does.
        approximations: what its worlds compute less well than they could, in words.
    """

    make: MakeEnv
    sizes: Sizes
    reward_terms: int
    reward_weights: Callable[[Conditions], Tensor]
    outcomes: tuple[str, ...] = ()
    logged_terms: tuple[str, ...] = ()
    learnability: Callable[[], Learnability] | None = None
    approximations: tuple[str, ...] = ()


def rotation_environment(config: EnvConfig) -> Environment:
    """The rotation task as configured."""
    joints = config.hand.joints
    return Environment(
        make=partial(make_env, config),
        sizes=Sizes(2 * joints * config.stack, OBJECT + joints, joints),
        reward_terms=len(config.reward.terms),
        reward_weights=partial(_weights, config),
        outcomes=OUTCOMES,
        logged_terms=config.reward.borne_terms,
        learnability=partial(config.randomization.learnability, config.constants),
        approximations=tuple(config.approximations()),
    )


def _weights(config: EnvConfig, conditions: Conditions) -> Tensor:
    return torch.from_numpy(config.reward.weights(conditions.penalty_scale))


def as_environment(made: Any) -> Environment:
    """What `env` in the configuration stands for: an environment, or the rotation task's configuration."""
    return made if isinstance(made, Environment) else rotation_environment(made)
