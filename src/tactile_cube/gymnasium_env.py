"""The training environment, transforms included, with Gymnasium's interface."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict, TensorDictBase

from tactile_cube.api.environment import env_config
from tactile_cube.env import OUTCOMES, RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.rollout import Recorder
from tactile_cube.evaluation.verdict import judge_episode
from tactile_cube.transforms import EnvConfig, make_env
from tactile_cube.visualization.scene import BELOW, SIDE, Scene

Observation = NDArray[np.float32]
Picture = NDArray[np.uint8]
FULL_TURN = 2.0 * np.pi  # bound of the readings: no joint of a hand turns that far [rad]
VIEW = 256  # edge of each of the two views in a picture [pixels]


class GymnasiumRotation(gymnasium.Env[Observation, Observation]):
    """One world with stacked, noisy observations (120,) and actions (12,) in [-1, 1].

    `info` has "theta" [rad], "outcome", "faulty", "reward_terms" by name, and "privileged" (25,) for critics that may
    see the object; in the last step of an episode also "is_success", as `evaluate` counts it.
    `render` shows what films of `evaluate` show. Torch's global generator is left alone.

    Example:
        >>> env = gymnasium.make("tactile_cube/Rotation-v0", task="table", start="wide_yaw")
        >>> observation, info = env.reset(seed=0)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(self, config: EnvConfig, render_mode: str | None = None, judged: bool = True) -> None:
        """Build the world; with `judged` episodes are recorded for "is_success".

        Raises:
            InputError: another render mode than "rgb_array", or None for no pictures.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode is {render_mode!r}; choose 'rgb_array' or None")
        self.render_mode = render_mode
        self._judged, self._seeded = judged, False
        self._recorder: Recorder | None = None
        self._scene: Scene | None = None
        self._env = make_env(config, worlds=1, seed=0, evaluation=True)
        self._terms = config.reward.terms
        shape = tuple(self._env.observation_spec["observation"].shape[1:])
        self.observation_space = gymnasium.spaces.Box(-FULL_TURN, FULL_TURN, shape, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (config.hand.joints,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start the next episode; with a `seed`, the first of a new sequence, which else begins at random."""
        super().reset(seed=seed)
        if seed is None and not self._seeded:
            seed = int(self.np_random.integers(2**31))
        self._seeded = True
        if seed is not None:
            self._env.set_seed(seed)
        data = self._env.reset()
        self._recorder = Recorder(self._env) if self._judged else None
        self._close_scene()  # the next object may be of another size
        return data["observation"][0].numpy().copy(), _info(data, self._terms)

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Run one policy step of 0.1 s.

        Raises:
            InputError: an action of another shape, or one that is no number.
        """
        action = np.asarray(action, dtype=np.float32)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise InputError(f"action {action}: give {self.action_space.shape} finite numbers from -1 to 1")
        command = torch.as_tensor(np.clip(action, -1.0, 1.0), dtype=torch.float32)[None]
        data = self._env.step(TensorDict({"action": command}, batch_size=[1]))["next"]
        info, ends = _info(data, self._terms), (bool(data["terminated"]), bool(data["truncated"]))
        if self._recorder is not None:
            self._recorder.add(data)
            if any(ends):
                info["is_success"] = judge_episode(self._recorder.record(0)).success
        return data["observation"][0].numpy().copy(), float(data["reward"]), *ends, info

    def render(self) -> Picture | None:
        """Return hand and cube from the side and from below (256, 512, 3) with render_mode "rgb_array", else None."""
        if self.render_mode is None:
            return None
        task: RotationEnv = self._env.base_env.tasks[0]
        if self._scene is None:
            self._scene = Scene(np.asarray(task.constants.cube_size), task.hand, task.constants.object_shape)
        self._scene.pose(task.world.q, task.world.cube_position, task.world.cube_quaternion)
        views = [np.asarray(self._scene.picture(camera, VIEW, VIEW)) for camera in (SIDE, BELOW)]
        return np.concatenate(views, axis=1)

    def _close_scene(self) -> None:
        if self._scene is not None:
            self._scene.close()
            self._scene = None

    def close(self) -> None:
        """Close the world and its pictures."""
        self._close_scene()
        self._env.close()


def _info(data: TensorDictBase, terms: Sequence[str]) -> dict[str, Any]:
    return {
        "theta": float(data["theta"]),
        "outcome": OUTCOMES[int(data["outcome"])],
        "faulty": bool(data["faulty"]),
        "reward_terms": dict(zip(terms, data["reward_terms"][0].tolist(), strict=True)),
        "privileged": data["privileged"][0].numpy().copy(),
    }


def make_rotation(render_mode: str | None = None, **settings: Any) -> GymnasiumRotation:
    """Return the environment that `tactile_cube.make_env` has of the same settings, for one world.

    Args:
        render_mode: "rgb_array", or None for no pictures.
        settings: of `tactile_cube.env_config`, e.g. task="table", engine="mujoco".

    Raises:
        InputError: a setting or an option that there is not.
    """
    return GymnasiumRotation(env_config(**settings), render_mode)
