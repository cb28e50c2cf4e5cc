"""A policy on disk: safetensors with the actor's layers and, as metadata, what is needed to run it.

Tensors are named `actor.<layer>.weight` (out, in) and `actor.<layer>.bias` (out,), layer 0 first, ReLU between layers;
the last layer gives mean and raw log sigma side by side, and the action is tanh(mean).
The metadata's `sha256` is the digest of the whole file with 64 zeros in the digest's own place: any changed byte shows.
"""

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

import torch
from pydantic import BaseModel, ConfigDict, Field, PositiveInt
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from tactile_cube.agent.batch import Sizes
from tactile_cube.agent.networks import Actor
from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

FORMAT = "tactile_cube policy 2"
WITHOUT_CHECKSUM = "tactile_cube policy 1"
NO_DIGEST = b"0" * 64


class PolicyInfo(BaseModel):
    """Where a policy comes from and what it expects.

    Attributes:
        observation_size: width of the stacked observation.
        action_size: number of joints commanded.
        action_low: lower end of the action range.
        action_high: upper end of the action range.
        hidden: widths of the hidden layers.
        time_constant: T_s [s] of the target filter it was last trained with; None if unknown.
        seed: of the training run.
        steps: environment steps it was trained for.
        commit: of the code that trained it; "unknown" outside a checkout.
        performance: mean final angle [rad] of the last training episodes when it was saved; None if unknown.
        averaged: after how many steps the policies were kept whose mean weights these are; empty: it is no mean.
        config: the training configuration, resolved.
    """

    model_config = ConfigDict(frozen=True)

    observation_size: PositiveInt
    action_size: PositiveInt
    action_low: float = -1.0
    action_high: float = 1.0
    hidden: tuple[PositiveInt, ...]
    time_constant: float | None = None
    seed: int = 0
    steps: int = 0
    commit: str = "unknown"
    performance: float | None = None
    averaged: tuple[int, ...] = ()
    config: dict[str, Any] = Field(default_factory=dict)

    @classmethod
    def describe(cls, actor: Actor, **provenance: Any) -> Self:
        """Sizes read off the actor, the rest as given."""
        widths = [layer.out_features for layer in _linears(actor)]
        return cls(
            observation_size=_linears(actor)[0].in_features,
            action_size=widths[-1] // 2,
            hidden=tuple(widths[:-1]),
            **provenance,
        )


def save_policy(path: Path, actor: Actor, info: PolicyInfo) -> None:
    """Write a policy file; readers never see it half written."""
    tensors: dict[str, Tensor] = {}
    for index, layer in enumerate(_linears(actor)):
        tensors[f"actor.{index}.weight"] = layer.weight.detach().cpu().contiguous()
        tensors[f"actor.{index}.bias"] = layer.bias.detach().cpu().contiguous()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, sealed(tensors, info.model_dump_json()))


def sealed(tensors: dict[str, Tensor], info: str) -> bytes:
    """The contents of a policy file: tensors, and metadata with the checksum of all of it."""
    content = save(tensors, {"sha256": NO_DIGEST.decode(), "format": FORMAT, "info": info})
    return content.replace(NO_DIGEST, _digest(content), 1)


def load_policy(path: Path | str) -> tuple[Actor, PolicyInfo]:
    """Read a policy file.

    Raises:
        InputError: the file is missing, damaged, no policy, or its tensors do not have the sizes it states.

    A file from before there were checksums is read with a warning.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such policy file; train one or give policy=<file>.safetensors")
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 - safe_open is no mapping
    except (SafetensorError, OSError, RuntimeError) as error:
        raise InputError(f"{path}: damaged or not a safetensors file ({error})") from error
    _verify(path, metadata)
    info = _read_info(path, metadata)
    actor = Actor(Sizes(info.observation_size, 0, info.action_size), info.hidden).requires_grad_(False)
    _fill(path, actor, tensors)
    return actor, info


def require_sizes(path: Path | str, info: PolicyInfo, observation_size: int, action_size: int) -> None:
    """Refuse a policy of other shape than the environment's."""
    if (info.observation_size, info.action_size) != (observation_size, action_size):
        raise InputError(
            f"{path}: policy maps {info.observation_size} observations to {info.action_size} actions, the environment "
            f"has {observation_size} and {action_size}; use a policy trained with this observation stack"
        )


def current_commit() -> str:
    """Commit of the checkout this code runs from, "-dirty" appended when it was changed; "unknown" elsewhere."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        run = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip() or "unknown"


def _linears(actor: Actor) -> list[nn.Linear]:
    return [layer for layer in actor.body if isinstance(layer, nn.Linear)]


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def _verify(path: Path, metadata: dict[str, str]) -> None:
    """Refuse another format, and contents that the checksum in them does not fit."""
    if metadata.get("format") == WITHOUT_CHECKSUM:
        print(f"warning: {path}: from before there were checksums; damage would go unseen", file=sys.stderr)
        return
    if metadata.get("format") != FORMAT:
        raise InputError(f"{path}: not a policy file (format {metadata.get('format')!r}, expected {FORMAT!r})")
    stated = metadata.get("sha256", "").encode()
    if len(stated) != len(NO_DIGEST) or _digest(path.read_bytes().replace(stated, NO_DIGEST, 1)) != stated:
        raise InputError(f"{path}: damaged, its checksum does not fit its contents; take another copy of the file")


def _read_info(path: Path, metadata: dict[str, str]) -> PolicyInfo:
    try:
        return PolicyInfo.model_validate(json.loads(metadata["info"]))
    except (KeyError, ValueError, RecursionError) as error:  # no JSON, huge numbers, deep lists, another schema
        raise InputError(f"{path}: metadata of the policy cannot be read ({type(error).__name__})") from error


def _fill(path: Path, actor: Actor, tensors: dict[str, Tensor]) -> None:
    wanted = {f"actor.{i}.{name}": p for i, layer in enumerate(_linears(actor)) for name, p in layer.named_parameters()}
    if set(tensors) != set(wanted):
        raise InputError(f"{path}: has tensors {sorted(tensors)}, expected {sorted(wanted)}")
    for key, parameter in wanted.items():
        if tensors[key].shape != parameter.shape:
            shapes = f"{tuple(tensors[key].shape)}, expected {tuple(parameter.shape)}"
            raise InputError(f"{path}: {key} has shape {shapes} for the sizes in its metadata")
        if not torch.isfinite(tensors[key]).all():
            raise InputError(f"{path}: {key} holds values that are not finite")
        parameter.copy_(tensors[key])
