"""A connection to Ray: a cluster of its own on this machine, or one that runs already."""

import contextlib
import logging
import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import TimeoutError
from typing import Any, TypeVar

from tactile_cube.errors import InputError
from tactile_cube.training.collection import Background, CollectionError

STORE = 256 * 2**20
"""Bytes of shared memory for what is sent: a recording is a few megabytes."""
CONNECT = 5.0
"""Longest wait [s] for a cluster's address to accept a connection."""
ANSWER = 60.0
"""Longest wait [s] for a cluster to answer as one: on two busy cores it took 3."""
T = TypeVar("T")
R = TypeVar("R")
QUIET: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}


class RayCluster:
    """Ray, connected until it is closed. One at a time in a process.

    Args:
        address: host:port of a cluster that this machine is a node of; None: one of its own, on the loopback interface,
            with a password of its own, no dashboard and no usage statistics. It ends with this process, however that
            ends.
        workers: how many cores it has.
        seconds: how long to try to start one of its own.
        asked: the setting that asks for it, for what is said about it.

    Raises:
        InputError: Ray is not installed; the address is none, or nothing or something else answers there.
        CollectionError: a cluster of its own did not start.
    """

    def __init__(self, address: str | None, workers: int, seconds: float, asked: str = "collector.address"):
        self._folder: str | None = None
        self._reaper: subprocess.Popen[bytes] | None = None
        ray = _ray()
        if address is not None:
            join(ray, address, asked)
            return
        until = time.monotonic() + seconds
        while self._reaper is None:
            self._start(ray, workers, until)

    def _start(self, ray: Any, workers: int, until: float) -> None:
        self._folder = tempfile.mkdtemp(prefix="ray-")  # a short path: it holds sockets
        _stay_on_loopback()
        before = _descendants()
        try:
            ray.init(
                address="local",  # None would take RAY_ADDRESS
                num_cpus=workers,
                num_gpus=0,
                include_dashboard=False,
                object_store_memory=STORE,
                _temp_dir=self._folder,
                **QUIET,
            )
        except Exception as error:
            for pid in _descendants() - before:  # Ray forgets what it started in vain
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self.close()
            # a node has 30 s, which on a machine with much else to do may be too few
            if "timed out" not in str(error) or time.monotonic() > until:
                raise CollectionError(f"Ray did not start on this machine: {_line(error)}") from error
        else:
            self._reaper = _end_with_this_process(_descendants() - before, self._folder)

    def each(self, work: Callable[[T], R], over: Sequence[T]) -> Iterator[tuple[T, R]]:
        """What `work` makes of each, a core each, in the order in which it is done; lost with a node, it runs again.

        Raises:
            CollectionError: one that was lost again and again; what `work` raises is raised as it is.
        """
        ray = _ray()
        call = ray.remote(num_cpus=1)(_applied)
        waiting = {call.remote(work, one): one for one in over}
        while waiting:
            (done,), _ = ray.wait(list(waiting))
            one = waiting.pop(done)
            try:
                made = ray.get(done)
            except ray.exceptions.RayTaskError as error:
                raise error.cause or error from None
            except ray.exceptions.RayError as error:
                raise CollectionError(f"a worker of Ray was lost again and again: {_line(error)}") from error
            yield one, made

    def close(self) -> None:
        """Leave the cluster, which ends what ran there for this process; one of its own ends."""
        _ray().shutdown()
        if self._reaper is not None:
            self._reaper.kill()
            self._reaper.communicate()
            self._reaper = None
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


def _applied(work: Callable[[T], R], one: T) -> R:
    return work(one)


def join(ray: Any, address: str, asked: str = "collector.address") -> None:
    """Connect the module `ray` to the cluster at an address.

    Raises:
        InputError: it is none, or nothing or something else answers there.
    """
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not port.isdigit():
        raise InputError(f"{asked}={address}: give host:port of a Ray cluster's head, e.g. 192.168.1.2:6379")
    try:
        socket.create_connection((host, int(port)), timeout=CONNECT).close()
    except (OSError, OverflowError) as error:
        raise InputError(
            f"{asked}={address}: nothing answers there ({error}); is the cluster up (ray status)?"
        ) from None
    thread = Background()  # Ray tries for minutes
    try:
        thread.submit(lambda: ray.init(address=address, **QUIET)).result(timeout=ANSWER)
    except TimeoutError:
        raise InputError(f"{asked}={address}: no Ray cluster answered within {ANSWER:g} s") from None
    except Exception as error:
        raise InputError(
            f"{asked}={address}: {_line(error)}; this machine must be a node of it (ray start --address={address})"
        ) from None
    finally:
        thread.close()


def _ray() -> Any:
    try:
        import ray
    except ImportError:
        raise InputError("Ray is not installed; pip install 'tactile-cube[ray]'") from None
    from ray._private import auto_init_hook

    auto_init_hook.enable_auto_connect = False  # a call that comes late must not start a cluster or find another
    return ray


def _stay_on_loopback() -> None:
    """Let nobody else in: neither other machines nor other users of this one."""
    from ray._private import ray_constants

    os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # Ray's switch for addresses within one machine
    ray_constants.ENABLE_RAY_CLUSTER = False  # the same: torchrl has imported Ray, which has read the switch
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))  # else Ray leaves one in the user's home


def _descendants() -> set[int]:
    import psutil  # Ray brings it

    return {process.pid for process in psutil.Process().children(recursive=True)}


def _end_with_this_process(pids: set[int], folder: str) -> "subprocess.Popen[bytes]":
    """A process that clears up when this one is gone: two of Ray's would stay for a minute, and its folder for good."""
    script = 'read _; folder="$1"; shift; kill -9 "$@"; rm -rf "$folder"'  # it reads until this end is closed
    command = ["sh", "-c", script, "sh", folder, *map(str, pids)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:300]
