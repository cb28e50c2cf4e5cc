"""Write a policy for a robot from a program, or run it in numpy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tactile_cube.api.input_errors import as_input_errors
from tactile_cube.api.job import PathLike

if TYPE_CHECKING:
    from tactile_cube.deployment.network import Network


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
def export(policy: PathLike | None, output: PathLike) -> Path:
    """Write a policy as plain arrays (.npz) or ONNX (.onnx), with the contract it is to be run by beside it.

    Args:
        policy: as in `load_policy`.
        output: file to write.

    Returns:
        Path of the contract.

    Raises:
        InputError: unknown ending, or ONNX is not installed.
    """
    from tactile_cube.deployment.export import export_policy

    return export_policy(load_policy(policy), Path(output))
