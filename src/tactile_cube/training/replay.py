"""Experience replay: TorchRL's buffer of transitions by key; a checkpoint appends them as float32 rows to files."""

import hashlib
import logging
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tensordict import NestedKey, TensorDict, TensorDictBase
from torch import Tensor
from torchrl.data import LazyTensorStorage, ReplayBuffer, TensorDictReplayBuffer

from tactile_cube.agent.networks import Sizes
from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

logging.getLogger("torchrl").setLevel(logging.WARNING)  # it announces each storage


FLAGS: tuple[NestedKey, ...] = (("next", "terminated"), "demonstrated")


class Rows:
    """The filled part of a ring as float32 rows (len, width), made where they are asked for."""

    def __init__(self, buffer: ReplayBuffer, widths: Mapping[NestedKey, int]):
        self._buffer, self._widths = buffer, widths
        self.shape = (len(buffer), sum(widths.values()))

    def __getitem__(self, index: Any) -> Tensor:
        """Some of them, keys side by side."""
        if not len(self._buffer):
            return torch.zeros(self.shape)
        chosen = self._buffer[index]
        return torch.cat([chosen[key].float() for key in self._widths], -1)


class Replay:
    """Experience replay.

    Rewards are kept as unweighted terms and weighed at sampling, so that a schedule of the weights leaves no stale
    rewards.

    Args:
        capacity: transitions kept; the oldest are overwritten.
        sizes: widths of observation, privileged state and action.
        reward_terms: number of reward terms.
        seed: of the sampling generator.
        make: makes the buffer from `storage` and `generator`.

    Raises:
        InputError: the machine has less memory than that takes.
    """

    def __init__(
        self,
        capacity: int,
        sizes: Sizes,
        reward_terms: int,
        seed: int,
        make: Callable[..., ReplayBuffer] = TensorDictReplayBuffer,
    ):
        self.widths: dict[NestedKey, int] = {
            "observation": sizes.observation,
            "privileged": sizes.privileged,
            "action": sizes.action,
            ("next", "reward_terms"): reward_terms,
            ("next", "observation"): sizes.observation,
            ("next", "privileged"): sizes.privileged,
            ("next", "terminated"): 1,
            "steps_to_next_obs": 1,
            "demonstrated": 1,
        }
        self.capacity, self.width = capacity, sum(self.widths.values())
        size = 4 * capacity * self.width
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else size
        if size > memory:  # it would be taken page by page, hours later
            raise InputError(
                f"training.replay_size={capacity}: takes {size / 2**30:.3g} GiB, this machine has "
                f"{memory / 2**30:.3g}; keep fewer transitions"
            )
        self.generator = torch.Generator().manual_seed(seed)
        self.buffer = make(storage=LazyTensorStorage(capacity), generator=self.generator)

    def __len__(self) -> int:
        """Transitions held now."""
        return len(self.buffer)

    @property
    def rows(self) -> Rows:
        """The filled part of the ring, (len, width)."""
        return Rows(self.buffer, self.widths)

    def extend(self, transitions: Mapping[NestedKey, Tensor] | TensorDictBase) -> None:
        """Append transitions (rows,) with the keys of `widths`."""
        count = min(len(transitions["observation"]), self.capacity)
        if count:
            kept = {key: transitions[key][-count:] for key in self.widths}
            typed = {key: part.bool() if key in FLAGS else part.float() for key, part in kept.items()}
            self.buffer.extend(TensorDict(typed, [count]))

    def sample(self, size: int, weights: Tensor) -> TensorDictBase:
        """Draw `size` transitions with replacement, as TorchRL's losses read them; reward = reward_terms @ weights."""
        batch: TensorDictBase = self.buffer.sample(size)
        following = batch["next"]
        following["reward"] = (following["reward_terms"] @ weights).unsqueeze(-1)
        following["done"] = following["terminated"]  # a time limit ends no episode for good: its last state counts
        return batch

    def state_dict(self) -> dict[str, Any]:
        """The filled part of the ring, where to write next, and the generator."""
        return {
            "rows": self.rows,
            "written": self.buffer.write_count,
            "capacity": self.capacity,
            "generator": self.generator.get_state(),
            "sampler": self.buffer.sampler.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Inverse of `state_dict`, for a ring of the same capacity and widths."""
        rows, width, written = state["rows"], self.width, state["written"]
        if rows.shape[1] != width or rows.shape[0] != min(written, self.capacity):
            raise InputError(
                f"replay in the checkpoint holds {rows.shape[0]} rows of width {rows.shape[1]}, this run's up to "
                f"{self.capacity} of width {width}; keep training.replay_size and the observation"
            )
        parts = torch.split(rows[:], list(self.widths.values()), -1)
        self.extend(dict(zip(self.widths, parts, strict=True)))
        self.buffer.writer.load_state_dict({"_cursor": written % self.capacity, "_write_count": written})
        self.buffer.sampler.load_state_dict(state["sampler"])
        self.generator.set_state(state["generator"])


FOLDER = "replay"
OWN = re.compile(r"\d{12,}\.f32(\.partial)?")

Segment = tuple[int, int, str]
"""Number of the first row, number of rows, SHA-256 of their float32 values."""


class ReplayFiles:
    """Rows by their number in order of arrival; row n lies at n % capacity of the ring."""

    def __init__(self, folder: Path):
        """Take the folder of a run.

        Raises:
            InputError: its `replay` is a link, behind which rows would be written and deleted.
        """
        self.folder = folder / FOLDER
        if self.folder.is_symlink():
            raise InputError(f"{self.folder}: is a link; a run keeps its replay in its own folder: delete the link")
        self._segments: list[Segment] = []

    def append(self, rows: Rows, written: int, capacity: int) -> list[Segment]:
        """Write the rows that are not on disk yet; gives the segments that hold the ring.

        Args:
            rows: the filled part of the ring, (min(written, capacity), width).
            written: rows that have arrived so far.
            capacity: of the ring.

        Raises:
            OSError: they cannot be written.
        """
        oldest = max(written - capacity, 0)
        kept = [segment for segment in self._segments if _end(segment) > oldest]
        first = max(_end(kept[-1]) if kept else oldest, oldest)
        if first < written:
            block = rows[torch.arange(first, written) % capacity].numpy().astype("<f4", copy=False).tobytes()
            self.folder.mkdir(exist_ok=True)
            write_whole(self._path(first), block)
            kept.append((first, written - first, hashlib.sha256(block).hexdigest()))
        self._segments = kept
        return kept

    def read(self, segments: Sequence[Segment], written: int, capacity: int, width: int) -> Tensor:
        """The filled part of the ring, (min(written, capacity), width); later rows are appended to these segments.

        Raises:
            InputError: a segment is missing or damaged, or they do not hold the rows of the ring.
        """
        self._require_whole(segments, written, capacity, width)
        ring = torch.empty(min(written, capacity), width)
        for segment in segments:
            path = self._path(segment[0])
            try:
                content = path.read_bytes()
            except OSError as error:
                raise InputError(f"{path}: cannot be read ({error.strerror})") from error
            if hashlib.sha256(content).hexdigest() != segment[2]:
                raise InputError(f"{path}: its checksum is wrong")
            block = torch.from_numpy(np.frombuffer(bytearray(content), "<f4")).reshape(-1, width)
            number = torch.arange(segment[0], _end(segment))
            inside = number >= written - capacity
            ring[number[inside] % capacity] = block[inside]
        self._segments = [(first, count, digest) for first, count, digest in segments]
        return ring

    def _require_whole(self, segments: Sequence[Segment], written: int, capacity: int, width: int) -> None:
        """Hold what a checkpoint claims against the files, before memory is taken for it."""
        at = max(written - capacity, 0)
        for segment in segments:
            if not segment[0] <= at < _end(segment):
                break
            at = _end(segment)
            path = self._path(segment[0])
            size = path.stat().st_size if path.is_file() else None
            if size != 4 * width * segment[1]:
                found = "is missing" if size is None else f"has {size} bytes"
                raise InputError(f"{path}: {found}, the checkpoint claims {segment[1]} rows of {width} numbers in it")
        if at != written:
            raise InputError(f"{self.folder}: holds the replay up to row {at}, the checkpoint claims {written} rows")

    def delete_all_but(self, segments: Iterable[Segment]) -> None:
        """Delete segments that no checkpoint refers to, and nothing else."""
        wanted = {self._path(first) for first, _, _ in segments}
        for path in self.folder.glob("*"):
            if OWN.fullmatch(path.name) and path not in wanted:
                path.unlink(missing_ok=True)

    def clear(self) -> None:
        """Delete all segments, and the folder if nothing else is in it."""
        self.delete_all_but(())
        with suppress(OSError):
            self.folder.rmdir()

    def _path(self, first: int) -> Path:
        return self.folder / f"{first:012d}.f32"


def _end(segment: Segment) -> int:
    return segment[0] + segment[1]
