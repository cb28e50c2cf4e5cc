"""Write a policy for a robot from a program, or run it in numpy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_cube.api.job import Job, PathLike, as_input_errors, called_job

if TYPE_CHECKING:
    from tactile_cube.deployment.network import Network
    from tactile_cube.deployment.training_setting import TrainingSetting
    from tactile_cube.hand import Hand


@as_input_errors
def load_policy(policy: PathLike | None = None) -> Network:
    """A trained policy in numpy: call it with observations `(..., 120)` for actions `(..., 12)` in [-1, 1].

    Args:
        policy: a policy file, a training run's folder, or a policy that ships with the package; None: the shipped one.

    Raises:
        InputError: there is no such policy, or its file is damaged.

    Example:
        >>> action = tactile_cube.load_policy("table")(observation)
    """
    from tactile_cube.deployment.network import read_network
    from tactile_cube.evaluation.policy_path import policy_path

    return read_network(policy_path(None if policy is None else str(policy)))


@as_input_errors
def export(policy: PathLike | None, output: PathLike, *settings: str) -> Path:
    """Write a policy as plain arrays (.npz) or ONNX (.onnx), with the contract it is to be run by beside it.

    Args:
        policy: as in `load_policy`.
        output: file to write.
        settings: as on the command line, e.g. "hand=my_hand" for a policy of a hand whose URDF is yours.

    Returns:
        Path of the contract.

    Raises:
        InputError: unknown ending, or ONNX is not installed.
    """
    named = {"policy": None if policy is None else str(policy), "output": str(output)}
    return run_export(called_job("export", settings, **named))[1]


def run_export(job: Job) -> tuple[Path, Path]:
    """Write the files of a job; gives the network's and the contract's."""
    from tactile_cube.deployment.export import FORMATS, export_policy
    from tactile_cube.errors import InputError
    from tactile_cube.evaluation.policy_path import policy_path

    config, source = job.config, policy_path(job.config.policy)
    if config.output is None and config.format not in FORMATS:
        raise InputError(f"format={config.format}: choose {' or '.join(FORMATS)}")
    output = Path(config.output or f"{source.stem}.{config.format}")
    network = load_policy(source)
    return output, export_policy(network, output, setting_of(config, network))


def setting_of(config: Any, network: Network, trained: bool = True) -> TrainingSetting:
    """What the policy was trained with, on the hand and with the object that are named where its file cannot.

    Args:
        config: with `hand` and `object` where they are named.
        network: the policy.
        trained: whether the hand has to be the policy's; else it is any, as for an excitation in place of a policy.

    Raises:
        InputError: a policy on another hand than its own.
    """
    from hydra.utils import instantiate
    from omegaconf import OmegaConf

    from tactile_cube.deployment.training_setting import TrainingSetting, training_setting

    hand: Hand | None = instantiate(config.hand, _convert_="all") if config.get("hand") else None
    if hand is not None and not trained:
        return TrainingSetting.of(hand)
    object_: Any = OmegaConf.to_container(config.object, resolve=True) if config.get("object") else None
    return training_setting(network.info, hand, object_, network.label)
