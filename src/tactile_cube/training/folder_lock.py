"""One process at a time trains in a run folder."""

from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

from tactile_cube.errors import InputError

LOCK = ".lock"


def lock_folder(folder: Path) -> BaseFileLock:
    """Take the folder's lock; the system gives it back when the process ends, however it ends.

    Raises:
        InputError: another process has it: two of them would overwrite each other's checkpoints.
    """
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError(
            f"{folder}: another process trains in this folder; wait for its end (seconds after Ctrl-C), or "
            "give this run another name=... or seed=..."
        ) from None
    return lock
