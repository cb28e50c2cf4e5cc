"""The same environment, transforms included, for learners that speak Gymnasium."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict, TensorDictBase

from tactile_cube.api.job import as_input_errors
from tactile_cube.env import BORNE_TERMS, OUTCOMES, REWARD_TERMS, RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.rollout import Recorder
from tactile_cube.evaluation.verdict import EpisodeVerdict, judge_episode
from tactile_cube.transforms import EnvConfig, JointOffset, make_env
from tactile_cube.visualization.scene import BELOW, SIDE, Scene

Observation = NDArray[np.float32]
Picture = NDArray[np.uint8]

FULL_TURN = 2.0 * np.pi
"""Bound of the readings: no joint of a hand turns that far [rad]."""


VIEW = 256
"""Edge of each of the two views in a picture [pixels]."""


class GymnasiumRotation(gymnasium.Env[Observation, Observation]):
    """One world with stacked, noisy observations (120,) and actions (12,) in [-1, 1].

    `info` has "theta" [rad], "outcome", "faulty", "reward_terms" by name, and "privileged" (25,) for critics that may
    see the object; in the last step of an episode also "is_success": whether the verdict of `evaluate` is regrasping.
    `render` shows what films of `evaluate` show. Random numbers come from a generator of its own: neither does it
    disturb torch's global one nor is it disturbed.

    Example:
        >>> env = gymnasium.make("tactile_cube/Rotation-v0", task="table", start="wide_yaw")
        >>> observation, info = env.reset(seed=0)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(self, config: EnvConfig, render_mode: str | None = None, judged: bool = True) -> None:
        """Builds the world.

        Args:
            config: what the environment is.
            render_mode: "rgb_array", or None for no pictures.
            judged: whether episodes are recorded for "is_success".

        Raises:
            InputError: another render mode.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode is {render_mode!r}; choose 'rgb_array' or None")
        self.render_mode = render_mode
        self._judged = judged
        self._recorder: Recorder | None = None
        self._scene: tuple[NDArray[np.float64], Scene] | None = None
        with torch.random.fork_rng(devices=[]):
            self._env = make_env(config, worlds=1, seed=0, evaluation=True)
            self._generator = torch.get_rng_state()
        shape = tuple(self._env.observation_spec["observation"].shape[1:])
        self.observation_space = gymnasium.spaces.Box(-FULL_TURN, FULL_TURN, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (config.hand.joints,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts the next episode; with a `seed`, the first of a new sequence."""
        super().reset(seed=seed)
        with self._own_generator():
            if seed is not None:
                self._env.set_seed(seed)
            data = self._env.reset()
        if self._judged:
            offset = next(part.offset for part in self._env.transform if isinstance(part, JointOffset))
            self._recorder = Recorder(
                self._task, np.broadcast_to(offset.double().numpy(), (1, self._task.hand.joints))[0]
            )
        return data["observation"][0].numpy().copy(), _info(data)

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One policy step of 0.1 s."""
        command = torch.as_tensor(np.clip(action, -1.0, 1.0), dtype=torch.float32)[None]
        with self._own_generator():
            data = self._env.step(TensorDict({"action": command}, batch_size=[1]))["next"]
        ends = bool(data["terminated"]), bool(data["truncated"])
        return data["observation"][0].numpy().copy(), float(data["reward"]), *ends, _info(data) | self._success(data)

    def render(self) -> Picture | None:
        """Hand and cube from the side and from below (256, 512, 3), with render_mode "rgb_array"; else None."""
        if self.render_mode is None:
            return None
        world = self._task.world
        scene = self._scene_of(np.asarray(self._task.constants.cube_size))
        scene.pose(world.q, world.cube_position, world.cube_quaternion)
        return np.concatenate([np.asarray(scene.picture(camera, VIEW, VIEW)) for camera in (SIDE, BELOW)], axis=1)

    @property
    def _task(self) -> RotationEnv:
        task: RotationEnv = self._env.base_env.tasks[0]
        return task

    def _scene_of(self, cube_size: NDArray[np.float64]) -> Scene:
        """The scene of the last picture if the cube had this size, else a new one."""
        if self._scene is None or not np.array_equal(self._scene[0], cube_size):
            self._close_scene()
            self._scene = cube_size, Scene(cube_size, self._task.hand, self._task.constants.object_shape)
        return self._scene[1]

    def _close_scene(self) -> None:
        if self._scene is not None:
            self._scene[1].close()
            self._scene = None

    def _success(self, data: TensorDictBase) -> dict[str, bool]:
        if self._recorder is None:
            return {}
        self._recorder.add(data)
        if not bool(data["done"]):
            return {}
        return {"is_success": judge_episode(self._recorder.record(0), 0, 0).verdict is EpisodeVerdict.REGRASPING}

    @contextmanager
    def _own_generator(self) -> Iterator[None]:
        with torch.random.fork_rng(devices=[]):
            torch.set_rng_state(self._generator)
            yield
            self._generator = torch.get_rng_state()

    def close(self) -> None:
        """Closes the world and its pictures."""
        self._close_scene()
        self._env.close()


def _info(data: TensorDictBase) -> dict[str, Any]:
    return {
        "theta": float(data["theta"]),
        "outcome": OUTCOMES[int(data["outcome"])],
        "faulty": bool(data["faulty"]),
        "reward_terms": dict(zip(REWARD_TERMS + BORNE_TERMS, data["reward_terms"][0].tolist(), strict=False)),
        "privileged": data["privileged"][0].numpy().copy(),
    }


@as_input_errors
def make_rotation(
    task: str = "table",
    reward: str = "early",
    randomization: str = "paper",
    start: str = "wide_yaw",
    engine: str = "bullet",
    hand: str = "dlr_hand2",
    object: str = "box",
    overrides: tuple[str, ...] = (),
    render_mode: str | None = None,
) -> GymnasiumRotation:
    """Return the environment of the named options of `conf/`.

    Args:
        task: option of the group of that name.
        reward: option of the group of that name.
        randomization: option of the group of that name.
        start: option of the group of that name.
        engine: "bullet" or "mujoco".
        hand: option of the group of that name.
        object: option of the group of that name.
        overrides: further settings as on the command line, e.g. "task.filter_time=0.25".
        render_mode: "rgb_array", or None for no pictures.

    Raises:
        InputError: an option that there is not.
    """
    from hydra.utils import instantiate

    from tactile_cube.composition import composed

    groups = {
        "hand": hand,
        "object": object,
        "task": task,
        "reward": reward,
        "randomization": randomization,
        "start": start,
    }
    groups |= {"exploration": "none", "curriculum": "none", "env": "rotation"}
    chosen = [f"+{group}={option}" for group, option in groups.items()]
    config = composed(None, [*chosen, "+model=null", f"+engine={engine}", *overrides])
    return GymnasiumRotation(instantiate(config.env), render_mode)
