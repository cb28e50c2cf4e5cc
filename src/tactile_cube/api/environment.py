"""Training environments and grasps from a program."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from hydra.utils import instantiate
from torchrl.envs import TransformedEnv

from tactile_cube import transforms
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.api.job import PathLike, as_input_errors, as_word, settings_of
from tactile_cube.composition import composed
from tactile_cube.evaluation.grasp_search import find_grasps
from tactile_cube.randomization import Grasps
from tactile_cube.simulation import SimulationOptions, World
from tactile_cube.transforms import EnvConfig


@as_input_errors
def env_config(
    *,
    experiment: str | None = None,
    hand: str | None = None,
    object: str | None = None,
    task: str | None = None,
    reward: str | None = None,
    randomization: str | None = None,
    start: str | None = None,
    exploration: str | None = None,
    curriculum: str | None = None,
    env: str | None = None,
    engine: Literal["bullet", "mujoco", "mixed"] | None = None,
    model: PathLike | None = None,
    own_effects: Sequence[str] | None = None,
    values: Mapping[str, Any] | None = None,
) -> EnvConfig:
    """Return the environment of the groups of conf/train.yaml as plain data; keywords are those of `train`.

    Without an experiment this is the published task.

    Raises:
        InputError: a value that cannot be used.

    Example:
        >>> config = tactile_cube.env_config(task="table", values={"task.filter_time": 0.25})
    """
    words = [as_word(key, value) for key, value in settings_of(locals()).items()]
    made: EnvConfig = instantiate(composed("train", words).env)
    return made


def make_env(config: EnvConfig | None = None, *, worlds: int = 1, seed: int = 0) -> TransformedEnv:
    """Make a TorchRL environment of the hand: worlds, joint offsets, noise, sticky actions, the observation stack.

    It is the task itself, as Gymnasium's `tactile_cube/Rotation-v0` and `evaluate` have it: full weight and T_s of the
    task. A curriculum and extra exploration belong to `train`; an easier stage is set, as in
    `env_config(values={"task.gravity_scale": 0.05, "task.filter_time": 0.12})`. Torch's global generator is left alone.

    Args:
        config: of `env_config`; None: the published task.
        worlds: how many, simulated one after the other in this process.
        seed: of everything random in them.

    Example:
        >>> env = tactile_cube.make_env(tactile_cube.env_config(task="table"), worlds=4)
        >>> data = env.rollout(10)
    """
    return transforms.make_env(config or env_config(), worlds, seed, evaluation=True)


@as_input_errors
def search_grasps(config: EnvConfig | None = None, *, grasps: int = 2000, seed: int = 0) -> Grasps:
    """Search for grasps that hold the object by themselves; no gait and no policy takes part.

    Fingertips are put at random places and close; what still holds the object at full weight is kept.

    Args:
        config: of `env_config`, with hand and object; None: the published ones.
        grasps: how many to find.
        seed: of everything random.

    Raises:
        InputError: a value that cannot be used, or a hundred times as many tries find fewer.

    Example:
        >>> found = tactile_cube.search_grasps(tactile_cube.env_config(object="cylinder"))
        >>> found.save(Path("grasps.npz"))  # then start="grasps", values={"start.file": "grasps.npz"}
    """
    env, given = config or env_config(), "config, " if config else ""
    command = f"tactile_cube.search_grasps({given}grasps={grasps}, seed={seed})"
    return grasps_of(env, env.simulation, grasps, seed, command)


def grasps_of(env: EnvConfig, options: SimulationOptions, grasps: int, seed: int, command: str) -> Grasps:
    """Return the grasps of an environment's hand and object; their file says which command found them."""
    found = find_grasps(World(env.hand, options), env.constants, grasps, seed)
    return replace(found, origin=found.origin | {"command": command, "commit": current_commit()})
