"""Keep freed memory in the process: the tensors of an update are as large again in the next one."""

import ctypes
import os

TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD = -1, -2, -3
"""Numbers of glibc's mallopt."""


def keep_freed_memory() -> None:
    """Tell glibc not to give memory back after each update (2 to 20 % of its time); does nothing elsewhere."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        mallopt(TRIM_THRESHOLD, 1_000_000_000)
        mallopt(MMAP_THRESHOLD, 1_000_000_000)
        mallopt(TOP_PAD, 200_000_000)
