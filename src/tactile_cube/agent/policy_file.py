"""A policy on disk: safetensors with the actor's layers and, as metadata, what is needed to run it.

Tensors are named `actor.<layer>.weight` (out, in) and `actor.<layer>.bias` (out,), layer 0 first, ReLU between layers;
the last layer gives mean and raw log sigma side by side, and the action is tanh(mean).
The metadata's `sha256` is the digest of the whole file with 64 zeros in the digest's own place: any changed byte shows.

Every command reads a policy with `read_policy`, which needs no torch: checksum, sizes and numbers are checked in it.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load, save

from tactile_cube.drivetrain.plain_yaml import describe
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import regular
from tactile_cube.whole_file import write_whole

if TYPE_CHECKING:
    from tactile_cube.agent.networks import Actor

FORMAT = "tactile_cube policy 2"
NO_DIGEST = b"0" * 64
KEPT = re.compile(r"policy_(\d+)\.safetensors")  # policies that a run keeps each `training.policy_every` steps
LARGEST, LARGEST_HEADER = 1 << 28, 1 << 22
"""Bytes of a file and of its header; the shipped policies have 1.4 million and some thousand."""
WIDEST, DEEPEST = 1 << 16, 32
Width = Annotated[int, Field(gt=0, le=WIDEST)]  # number of units of a layer
Array = NDArray[np.float32]
Layer = tuple[Array, Array]  # weight (out, in) and bias (out,)


class PolicyInfo(BaseModel):
    """Metadata of a policy: its origin, and the environment that it expects.

    Attributes:
        observation_size: width of the stacked observation.
        action_size: number of joints commanded; their range is action_low to action_high.
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

    observation_size: Width
    action_size: Width
    action_low: float = -1.0
    action_high: float = 1.0
    hidden: tuple[Width, ...] = Field(max_length=DEEPEST)
    time_constant: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    seed: int = 0
    steps: int = 0
    commit: str = Field(default="unknown", pattern=r"^[\w.-]{1,64}$")
    performance: float | None = None
    averaged: tuple[int, ...] = ()
    config: dict[str, Any] = Field(default_factory=dict)

    @classmethod
    def describe(cls, actor: Actor, **provenance: Any) -> Self:
        """Return the sizes read off the actor, the rest as given."""
        widths = [layer.out_features for layer in actor.layers()]
        return cls(
            observation_size=actor.layers()[0].in_features,
            action_size=widths[-1] // 2,
            hidden=tuple(widths[:-1]),
            **provenance,
        )

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the file's tensors by name."""
        widths = itertools.pairwise((self.observation_size, *self.hidden, 2 * self.action_size))
        layers = {f"actor.{k}": pair for k, pair in enumerate(widths)}
        weights = {f"{name}.weight": (fan_out, fan_in) for name, (fan_in, fan_out) in layers.items()}
        return {**weights, **{f"{name}.bias": (fan_out,) for name, (_, fan_out) in layers.items()}}


def save_policy(path: Path, actor: Actor, info: PolicyInfo) -> None:
    """Write a policy file; readers never see it half written."""
    tensors: dict[str, Array] = {}
    for index, layer in enumerate(actor.layers()):
        tensors[f"actor.{index}.weight"] = layer.weight.detach().cpu().numpy()
        tensors[f"actor.{index}.bias"] = layer.bias.detach().cpu().numpy()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, sealed(tensors, info.model_dump_json()))


def sealed(tensors: Mapping[str, Array], info: str) -> bytes:
    """Return the contents of a policy file: tensors, and metadata with the checksum of the whole file."""
    content = save(dict(tensors), {"sha256": NO_DIGEST.decode(), "format": FORMAT, "info": info})
    return content.replace(NO_DIGEST, hashlib.sha256(content).hexdigest().encode(), 1)


def read_policy(path: Path) -> tuple[PolicyInfo, list[Layer]]:
    """Read a policy file: what it says of itself, and its layers, the first one first.

    Raises:
        InputError: the file is missing, too large, damaged, no policy, of other sizes than it states, or holds numbers
            that are not finite.
    """
    try:
        content = regular(path, LARGEST, "; train a policy or give policy=<file>.safetensors").read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    info = _read_info(path, _verified(path, content))
    try:
        tensors = load(content)
    except (SafetensorError, KeyError, ValueError) as error:
        raise InputError(f"{path}: damaged or not a policy file ({error})") from error
    _require(path, tensors, info.shapes())
    layers = range(len(info.hidden) + 1)
    return info, [(tensors[f"actor.{k}.weight"], tensors[f"actor.{k}.bias"]) for k in layers]


def load_actor(path: Path | str) -> tuple[Actor, PolicyInfo]:
    """Read a policy file as torch's network; raises what `read_policy` does."""
    import torch  # imports slowly, and the robot's computer does without it

    from tactile_cube.agent.networks import Actor, Sizes

    info, layers = read_policy(Path(path))
    actor = Actor(Sizes(info.observation_size, 0, info.action_size), info.hidden).requires_grad_(False)
    for own, (weight, bias) in zip(actor.layers(), layers, strict=True):
        own.weight.copy_(torch.from_numpy(weight))
        own.bias.copy_(torch.from_numpy(bias))
    return actor, info


def require_sizes(path: Path | str, info: PolicyInfo, observation_size: int, action_size: int) -> None:
    """Refuse a policy of other shape than the environment's."""
    if (info.observation_size, info.action_size) != (observation_size, action_size):
        raise InputError(
            f"{path}: policy maps {info.observation_size} observations to {info.action_size} actions, the environment "
            f"has {observation_size} and {action_size}; use a policy trained with this observation stack"
        )


def current_commit() -> str:
    """Return the commit of this code's checkout, "-dirty" appended when it was changed; "unknown" elsewhere."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        run = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip() or "unknown"


def _verified(path: Path, content: bytes) -> dict[str, Any]:
    """Return the metadata after a check of their format and of their checksum against the file."""
    size = int.from_bytes(content[:8], "little")
    if not size <= min(LARGEST_HEADER, len(content) - 8):
        raise InputError(f"{path}: damaged or not a policy file (a header of {size} bytes)")
    try:
        metadata = dict(json.loads(content[8 : 8 + size])["__metadata__"])
        stated = str(metadata.get("sha256")).encode()
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        reason = f"{type(error).__name__} in its header"
        raise InputError(f"{path}: damaged or not a policy file ({reason})") from error
    if metadata.get("format") != FORMAT:
        raise InputError(
            f"{path}: not a policy file (format {str(metadata.get('format'))[:40]!r}, expected {FORMAT!r})"
        )
    found = hashlib.sha256(content.replace(stated, NO_DIGEST, 1)).hexdigest().encode()
    if len(stated) != len(NO_DIGEST) or found != stated:
        raise InputError(f"{path}: damaged, its checksum does not fit its contents; take another copy of the file")
    return metadata


def _read_info(path: Path, metadata: Mapping[str, Any]) -> PolicyInfo:
    try:
        return PolicyInfo.model_validate(json.loads(metadata["info"]))
    except ValidationError as error:
        raise InputError(f"{path}: metadata of the policy: {describe(error)}") from error
    except (KeyError, TypeError, ValueError, RecursionError) as error:  # no JSON, huge numbers, deep lists
        raise InputError(f"{path}: metadata of the policy cannot be read ({type(error).__name__})") from error


def _require(path: Path, tensors: Mapping[str, Array], shapes: Mapping[str, Sequence[int]]) -> None:
    """Refuse other tensors than float32 numbers of the stated sizes, all of them finite."""
    odd = sorted(set(tensors) ^ set(shapes))
    if odd:
        raise InputError(f"{path}: {odd[0][:60]} is missing or too much for the sizes in its metadata")
    for key, wanted in shapes.items():
        found = tensors[key]
        if found.shape != wanted:
            raise InputError(f"{path}: {key} has shape {found.shape}, expected {wanted} for the sizes in its metadata")
        if found.dtype != np.float32:
            raise InputError(f"{path}: {key} holds {found.dtype}, expected float32")
        if not np.isfinite(found).all():
            raise InputError(f"{path}: {key} holds values that are not finite")


def kept_policies(run: Path, last: int) -> list[Path]:
    """Return the `last` newest policies that a run has kept, the oldest first.

    Raises:
        InputError: there is no such folder, or it has fewer of them.
    """
    if not run.is_dir():
        raise InputError(f"run={run}: no such folder; give that of a training run")
    steps = {path: int(found[1]) for path in run.iterdir() if (found := KEPT.fullmatch(path.name))}
    kept = sorted(steps, key=lambda path: steps[path])
    if not 1 <= last <= len(kept):
        raise InputError(
            f"last={last}: {run} has {len(kept)} kept policies (policy_STEPS.safetensors); ask for 1 to {len(kept)}, "
            "or train with a smaller training.policy_every"
        )
    return kept[-last:]


def averaged(files: Sequence[Path]) -> tuple[Actor, PolicyInfo]:
    """Return an actor with the mean weights of policy files, and the last file's metadata.

    The weights of a policy in training fluctuate around an optimum; their mean over time is closer to it. Source:
    Izmailov et al., *Averaging Weights Leads to Wider Optima and Better Generalization*, UAI 2018.

    Raises:
        InputError: a file is damaged, or not of the size of the last one.
    """
    loaded = [load_actor(file) for file in files]
    actor, info = loaded[-1]
    for file, (_, other) in zip(files, loaded, strict=True):
        if (other.observation_size, other.hidden) != (info.observation_size, info.hidden):
            raise InputError(
                f"{file}: its layers have other sizes than those of {files[-1]}; average one run's policies"
            )
    import torch  # as in load_actor

    with torch.no_grad():
        for weights in zip(*(other.parameters() for other, _ in loaded), strict=True):
            weights[-1].copy_(torch.stack(list(weights)).mean(0))
    return actor, info.model_copy(update={"averaged": tuple(other.steps for _, other in loaded), "performance": None})
