"""Training environments from a program."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tactile_cube.api.input_errors import as_input_errors
from tactile_cube.composition import composed

if TYPE_CHECKING:
    from torchrl.envs import TransformedEnv

    from tactile_cube.transforms import EnvConfig


@as_input_errors
def env_config(*settings: str) -> EnvConfig:
    """The environment of the groups of conf/train.yaml, as plain data.

    Args:
        settings: choices and values as on the command line, e.g. "task=table", "task.filter_time=0.25".

    Raises:
        InputError: a value that cannot be used.
    """
    from hydra.utils import instantiate

    made: EnvConfig = instantiate(composed("train", settings).env)
    return made


def make_env(*settings: str, worlds: int = 1, seed: int = 0) -> TransformedEnv:
    """A TorchRL environment of the hand: worlds, joint offsets, noise, sticky actions, the observation stack.

    Gymnasium's own way is `gymnasium.make("tactile_cube/Rotation-v0", task="table")` after `import tactile_cube`.

    Args:
        settings: as in `env_config`.
        worlds: how many, simulated one after the other in this process.
        seed: of everything random.

    Example:
        >>> env = tactile_cube.make_env("task=table", worlds=4)
        >>> data = env.rollout(10)
    """
    from tactile_cube.transforms import make_env as transformed

    return transformed(env_config(*settings), worlds, seed)
