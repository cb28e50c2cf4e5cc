"""Checkpoints from which a run resumes bit for bit: the two newest, replay included."""

import hashlib
import io
import zipfile
from pathlib import Path
from typing import Any, Self

import torch
from pydantic import BaseModel, ConfigDict, NonNegativeInt, PositiveInt, ValidationError, model_validator
from torch import Tensor

from tactile_cube.drivetrain.plain_yaml import describe
from tactile_cube.errors import InputError
from tactile_cube.run_folder import CHECKPOINT
from tactile_cube.untrusted_file import regular
from tactile_cube.whole_file import sync_folder, write_whole

FILE, BEFORE = CHECKPOINT, "checkpoint_before.pt"
HEAD = b"tactile_cube checkpoint 4, sha256 "
"""First words of a file; its checksum follows, then a line break, then what torch.save wrote."""
FREE = {
    "training": "steps policy_every reference trial_every trial_episodes log_iterations resume stop_if_no_regrasp_by "
    "regrasp_angle stop_when_angle_above stop_when_kept_above init_from",
    "collector": "timeout start_timeout start_method",
}
FREE_KEYS = {"own_effects", "logger"} | {f"{group}.{key}" for group, keys in FREE.items() for key in keys.split()}
"""Settings that may change between the sessions of a run: they do not touch what is learned from an iteration."""


class Checkpoints:
    """The checkpoints of a run folder: the newest, and the one before in case that is damaged."""

    def __init__(self, folder: Path):
        self.folder, self.notice = folder, ""

    def save(self, state: dict[str, Any]) -> None:
        """Write a state; a crash leaves the one before.

        Raises:
            InputError: it cannot be written, for instance because the disk is full.
        """
        path, aside = self.folder / FILE, self.folder / "checkpoint_next.pt"
        try:
            stream = io.BytesIO()
            torch.save(state, stream)
            content = stream.getvalue()  # a view of it may crash the garbage collector of some CPython 3.12
            write_whole(aside, HEAD, hashlib.sha256(content).hexdigest().encode(), b"\n", content)
            if path.exists():
                path.replace(self.folder / BEFORE)
            aside.replace(path)
            sync_folder(self.folder)
        except OSError as error:
            raise InputError(
                f"{path}: cannot be written ({error.strerror or error}); is the disk full? The checkpoint before it is "
                "whole, and the same command goes on from there"
            ) from error

    def load(self) -> dict[str, Any] | None:
        """Load the newest whole checkpoint, None if there never was one; set `notice` if it is not the newest.

        Raises:
            InputError: every checkpoint is damaged.
        """
        self.notice, newest = "", self.folder / FILE
        refusals: list[InputError] = []
        for path in (newest, self.folder / BEFORE):
            if path.is_dir():
                raise InputError(f"{path}: is a folder, where a checkpoint of the run belongs; move it away")
            if not path.is_file():
                continue
            try:
                state = load_checkpoint(path)
            except InputError as error:
                refusals.append(error)
                continue
            if path != newest:
                reason = refusals[0] if refusals else f"{newest}: was not finished"
                self.notice = f"{reason}; the run goes on from the checkpoint before it"
                path.replace(newest)  # else the next checkpoint would replace the whole one and keep the damaged one
            return state
        if refusals:
            raise InputError(f"{refusals[0]}; training.resume=never starts over")
        return None

    def clear(self) -> None:
        """Delete them all, to start over."""
        for name in (FILE, BEFORE):
            (self.folder / name).unlink(missing_ok=True)


class _Ring(BaseModel):
    model_config = ConfigDict(arbitrary_types_allowed=True)

    written: NonNegativeInt
    capacity: PositiveInt
    transitions: list[Tensor]
    generator: Any

    @model_validator(mode="after")
    def _holds_what_it_claims(self) -> Self:
        claimed = min(self.written, self.capacity)
        if any(part.shape[:1] != (claimed,) for part in self.transitions) or not self.transitions:
            raise ValueError(f"claims {claimed} transitions that it does not hold")
        return self


class _Learner(BaseModel):
    agent: dict[str, Any]
    replay: _Ring


class _State(BaseModel):
    learner: _Learner
    best_angle: float
    config: dict[str, Any]


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Read one file, weights only: nothing in it is run.

    Raises:
        InputError: the file is missing or damaged, claims more than it holds, or has numbers that are not finite.
    """
    regular(path)
    try:
        content = memoryview(path.read_bytes())
        head, content = bytes(content[: len(HEAD) + 65]), content[len(HEAD) + 65 :]
        if head.startswith(HEAD[:24]) and not head.startswith(HEAD):
            raise ValueError("of another version of this program; begin with its policy.safetensors")
        if head != HEAD + hashlib.sha256(content).hexdigest().encode() + b"\n":
            raise ValueError("its checksum is wrong or missing")
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for packed in archive.filelist:
                if packed.compress_type != zipfile.ZIP_STORED or packed.file_size > len(content):
                    raise ValueError("its parts are compressed or larger than the file")
        state: dict[str, Any] = torch.load(io.BytesIO(content), weights_only=True)
        _State.model_validate(state)
        for part in ("agent", "replay"):
            _require_sound(state["learner"][part], part, len(content))
    except ValidationError as error:
        raise InputError(f"{path}: damaged checkpoint ({describe(error)})") from error
    except Exception as error:  # torch raises half a dozen kinds for damaged files
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: damaged checkpoint ({reason})") from error
    return state


def _require_sound(part: Any, place: str, size: int) -> None:
    """Refuse tensors that are larger than the file (a view repeats numbers), or not finite, anywhere in a state."""
    if isinstance(part, Tensor):
        if part.numel() > size or not torch.isfinite(part).all():
            raise ValueError(f"{place} holds values that are not finite, or more than the file")
    elif isinstance(part, dict | list | tuple):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            _require_sound(value, f"{place}.{key}", size)


def require_same_settings(path: Path, saved: dict[str, Any], now: dict[str, Any]) -> None:
    """Refuse to go on with settings that change what is learned."""
    before, after = _flat(saved), _flat(now)
    keys = sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))
    bound = [key for key in keys if not {key, key.rpartition(".")[0]} & FREE_KEYS]
    if bound:
        changed = "; ".join(f"{key} was {before.get(key)}, is {after.get(key)}" for key in bound[:3])
        more = f" and {len(bound) - 3} more" if len(bound) > 3 else ""
        raise InputError(
            f"{path}: saved with other settings ({changed}{more}); give the run another name=<name> or "
            "start over with training.resume=never"
        )


def _flat(tree: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(tree, dict):
        return {prefix: tree}
    named = ((f"{prefix}.{key}" if prefix else str(key), value) for key, value in tree.items())
    return {name: leaf for key, value in named for name, leaf in _flat(value, key).items()}
