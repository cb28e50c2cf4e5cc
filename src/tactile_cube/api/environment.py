"""Training environments and grasps from a program."""

from __future__ import annotations

from dataclasses import replace

from hydra.utils import instantiate
from torchrl.envs import TransformedEnv

from tactile_cube import transforms
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.api.job import as_input_errors
from tactile_cube.composition import composed
from tactile_cube.evaluation.grasp_search import find_grasps
from tactile_cube.randomization import Grasps
from tactile_cube.simulation import SimulationOptions, World
from tactile_cube.transforms import EnvConfig


@as_input_errors
def env_config(*settings: str) -> EnvConfig:
    """The environment of the groups of conf/train.yaml, as plain data.

    Args:
        settings: choices and values as on the command line, e.g. "task=table", "task.filter_time=0.25".

    Raises:
        InputError: a value that cannot be used.
    """
    made: EnvConfig = instantiate(composed("train", settings).env)
    return made


def make_env(*settings: str, worlds: int = 1, seed: int = 0) -> TransformedEnv:
    """A TorchRL environment of the hand: worlds, joint offsets, noise, sticky actions, the observation stack.

    It is the task itself, as Gymnasium's `tactile_cube/Rotation-v0` and `evaluate` have it: full weight and T_s of the
    task. A curriculum and extra exploration belong to `train`; an easier stage is set, as in
    `make_env("task.gravity_scale=0.05", "task.filter_time=0.12")`. Torch's global generator is left alone.

    Args:
        settings: as in `env_config`.
        worlds: how many, simulated one after the other in this process.
        seed: of everything random in them.

    Example:
        >>> env = tactile_cube.make_env("task=table", worlds=4)
        >>> data = env.rollout(10)
    """
    return transforms.make_env(env_config(*settings), worlds, seed, evaluation=True)


@as_input_errors
def search_grasps(*settings: str, grasps: int = 2000, seed: int = 0) -> Grasps:
    """Search for grasps that hold the object by themselves; no gait and no policy takes part.

    Fingertips are put at random places and close; what still holds the object at full weight is kept.

    Args:
        settings: choices and values as on the command line, e.g. "hand=three_finger", "object=cylinder".
        grasps: how many to find.
        seed: of everything random.

    Raises:
        InputError: a value that cannot be used, or a hundred times as many tries find fewer.

    Example:
        >>> tactile_cube.search_grasps("object=cylinder").save(Path("grasps.npz"))  # then start=grasps start.file=...
    """
    words = ", ".join([*map(repr, settings), f"grasps={grasps}", f"seed={seed}"])
    env = env_config(*settings)
    return grasps_of(env, env.simulation, grasps, seed, f"tactile_cube.search_grasps({words})")


def grasps_of(env: EnvConfig, options: SimulationOptions, grasps: int, seed: int, command: str) -> Grasps:
    """Grasps of an environment's hand and object; their file says which command found them."""
    found = find_grasps(World(env.hand, options), env.constants, grasps, seed)
    return replace(found, origin=found.origin | {"command": command, "commit": current_commit()})
