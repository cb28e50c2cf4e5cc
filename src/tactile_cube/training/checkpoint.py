"""One file that a run goes on from, bit for bit."""

from pathlib import Path
from typing import Any

import torch

from tactile_cube.errors import InputError

FILE = "checkpoint.pt"
FREE_KEYS = {
    "training.steps",
    "training.checkpoint_barriers",
    "training.policy_every",
    "training.log_iterations",
    "training.resume",
    "training.stop_if_no_regrasp_by",
    "training.regrasp_angle",
    "training.stop_when_angle_above",
    "training.init_from",
    "collector.timeout",
    "collector.start_method",
}
"""Settings that may change between the sessions of a run: they do not touch what is learned from an iteration."""


def save_checkpoint(folder: Path, state: dict[str, Any]) -> Path:
    """Write the state so that a crash in between leaves the previous checkpoint whole.

    Raises:
        InputError: it cannot be written, for instance because the disk is full.
    """
    path = folder / FILE
    partial = path.with_suffix(".partial")
    try:
        torch.save(state, partial)
    except (OSError, RuntimeError) as error:  # torch raises a RuntimeError of its own where a disk is full
        partial.unlink(missing_ok=True)
        raise InputError(
            f"{path}: cannot be written ({str(error).splitlines()[0]}); is the disk full? The checkpoint before it, if "
            "there is one, is whole, and the same command goes on from there"
        ) from error
    partial.replace(path)
    return path


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Read a checkpoint.

    Raises:
        InputError: the file is missing or damaged.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such checkpoint")
    try:
        state: dict[str, Any] = torch.load(path, weights_only=True)
    except Exception as error:  # torch raises half a dozen kinds for damaged files
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: damaged checkpoint ({reason}); training.resume=never starts over") from error
    return state


def require_same_settings(path: Path, saved: dict[str, Any], now: dict[str, Any]) -> None:
    """Refuse to go on with settings that change what is learned."""
    before, after = _flat(saved), _flat(now)
    keys = sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))
    changed = [f"{key} was {before.get(key)}, is {after.get(key)}" for key in keys if key not in FREE_KEYS]
    if changed:
        more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
        raise InputError(
            f"{path}: saved with other settings ({'; '.join(changed[:3])}{more}); give the run another name=<name> or "
            "start over with training.resume=never"
        )


def _flat(tree: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(tree, dict):
        return {prefix: tree}
    result: dict[str, Any] = {}
    for key, value in tree.items():
        result |= _flat(value, f"{prefix}.{key}" if prefix else str(key))
    return result
