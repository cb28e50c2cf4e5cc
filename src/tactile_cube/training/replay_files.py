"""The replay on disk: a file for the rows that each checkpoint adds, none of them ever rewritten."""

import hashlib
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from tactile_cube.errors import InputError
from tactile_cube.training.replay import Rows
from tactile_cube.whole_file import write_whole

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
            block = self._read(segment).reshape(-1, width)
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

    def _read(self, segment: Segment) -> Tensor:
        path = self._path(segment[0])
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error
        if hashlib.sha256(content).hexdigest() != segment[2]:
            raise InputError(f"{path}: its checksum is wrong")
        return torch.from_numpy(np.frombuffer(bytearray(content), "<f4"))


def _end(segment: Segment) -> int:
    return segment[0] + segment[1]
