"""What decides in an episode: a trained actor, or one of the baselines it is compared with."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from tactile_cube.agent.networks import Actor
from tactile_cube.drivetrain.plain_yaml import read_yaml
from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.hand import Gait, grasp_angles

SQUEEZE = 0.010
"""How far the targets of the tips lie inside the faces when a baseline holds the cube [m]; gives 1 to 3 N."""


class Policy(Protocol):
    """Chooses the action of each policy step."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Begin an episode that has just been reset."""

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action `(joints,)` in [-1, 1] for the stacked observation."""


class ActorPolicy:
    """A trained actor without exploration: the same observation always gives the same action."""

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    def start(self, env: RotationEnv, seed: int) -> None:
        """Nothing to prepare: the actor has no memory beyond the stacked observation."""

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return tanh of the actor's mean."""
        with torch.no_grad():
            action = self._actor.deterministic(torch.from_numpy(observation)[None])
        return action[0].double().numpy()


class HoldPolicy:
    """Squeezes the cube where it is and never moves again; it is told where the cube starts."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Aim the fingertips `SQUEEZE` inside the faces."""
        world = env.world
        size = np.asarray(env.constants.cube_size)
        pose, shape = (world.cube_position, world.cube_quaternion), env.constants.object_shape
        angles = grasp_angles(env.hand, size, *pose, clearance=-SQUEEZE, shape=shape)
        self._action = env.hand.action_of(angles)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the same action at every step."""
        return self._action


class RandomPolicy:
    """Draws every action uniformly from the action range."""

    def start(self, env: RotationEnv, seed: int) -> None:
        """Seed the draws."""
        self._rng, self._joints = np.random.default_rng(seed), env.hand.joints

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return a fresh draw."""
        return self._rng.uniform(-1.0, 1.0, self._joints)


class ReplayPolicy:
    """Sends the targets of a recorded episode again, whatever the fingers feel.

    After the recording's end the last target is kept.
    """

    def __init__(self, targets: Array) -> None:
        self._targets = targets

    @classmethod
    def from_file(cls, path: Path) -> ReplayPolicy:
        """Read the targets from an episode that evaluate wrote (`*.npz`)."""
        record = EpisodeRecord.load(path)
        if record.steps == 0:
            raise InputError(f"{path}: the recorded episode has no steps to replay")
        return cls(record.target)

    def start(self, env: RotationEnv, seed: int) -> None:
        """Scale the targets to the hand's action range."""
        self._actions = env.hand.action_of(self._targets)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the recorded action of this step."""
        return np.asarray(self._actions[min(step, len(self._actions) - 1)])


class ScriptedPolicy:
    """Plays the gait in the rewarded direction."""

    def __init__(self, gait: Gait | None = None) -> None:
        self._gait = gait or Gait()

    @classmethod
    def from_file(cls, path: Path) -> ScriptedPolicy:
        """The best gait of a file that `benchmarks.teacher` wrote.

        Raises:
            InputError: it cannot be read, or holds no gait.
        """
        try:
            best = read_yaml(path)["best"]
            return cls(Gait(**best | {"phases": tuple(best["phases"])}))
        except (KeyError, TypeError) as error:
            raise InputError(f"policy=scripted:{path}: no gait of search_gait (key 'best')") from error

    def start(self, env: RotationEnv, seed: int) -> None:
        """Remember hand and direction."""
        self._hand, self._direction = env.hand, env.task.direction

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the action of the clock's step."""
        return self._gait.action(self._hand, step, self._direction)
