"""The Rerun viewer beside a program: a window where there is a display, a web page on this machine alone elsewhere."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from tactile_cube.errors import InputError

LOOPBACK = "127.0.0.1"
VIEWERS = ("auto", "window", "web", "none")
SERVER_MEMORY = "500MB"
"""Of what a viewer that is opened late is still given; an episode takes 1 to 5 MB."""


@dataclass(frozen=True)
class Viewer:
    """A viewer that runs in processes of its own.

    Attributes:
        process: what started it, first of its group: Rerun's module hands over to a program, which a signal to the
            module alone would leave behind.
        url: where a recording stream connects to it.
        page: address of the web viewer; None: it is a window.
    """

    process: subprocess.Popen[bytes]
    url: str
    page: str | None

    def end(self) -> None:
        """End it, program and all; without effect once it has ended."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait()


def has_display() -> bool:
    """Whether a window can be opened here."""
    if sys.platform != "linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def require_viewer(wanted: str, known: tuple[str, ...] = VIEWERS, key: str = "viewer") -> None:
    """Refuse what is no viewer.

    Raises:
        InputError: it is none of `known`.
    """
    if wanted not in known:
        raise InputError(f"{key}={wanted}: choose one of {', '.join(known)}")


def start_viewer(page: bool, *files: Path) -> Viewer:
    """Start a viewer bound to the loopback interface; it outlives the program, and Ctrl-C does not reach it.

    Args:
        page: serve the web viewer instead of opening a window.
        files: recordings to open.
    """
    port = free_port()
    # Without --bind it would be open to the whole network.
    words = [sys.executable, "-m", "rerun", "--bind", LOOPBACK, "--port", str(port)]
    url, address = f"rerun+http://{LOOPBACK}:{port}/proxy", None
    if page:
        web_port = free_port()
        address = f"http://{LOOPBACK}:{web_port}?url={quote(url, safe='')}"
        words += ["--serve-web", "--web-viewer-port", str(web_port), "--server-memory-limit", SERVER_MEMORY]
    silent = subprocess.DEVNULL
    process = subprocess.Popen(
        [*words, *map(str, files)], stdin=silent, stdout=silent, stderr=silent, start_new_session=True
    )
    return Viewer(process, url, address)


def free_port() -> int:
    """A free port of this machine."""
    with socket.socket() as tried:
        tried.bind((LOOPBACK, 0))
        return int(tried.getsockname()[1])


def show_files(files: Sequence[Path], wanted: str) -> str:
    """Open recordings as wanted; says in words where they are to be seen.

    Args:
        files: recordings, `.rrd`.
        wanted: "window", "web", "none", or "auto": a window where there is a display, else none.
    """
    require_viewer(wanted)
    if wanted == "web":
        viewer = start_viewer(True, *files)
        return f"look at {viewer.page} ; the server goes on until: kill -- -{viewer.process.pid}"
    if wanted == "window" or (wanted == "auto" and has_display()):
        start_viewer(False, *files)
        return "opening the Rerun viewer"
    named = " ".join(map(str, files))
    return f"to look at it: rerun {named} (or viewer=web: a page for a browser on this machine)"
