"""The Rerun viewer beside a program: a window where there is a display, a web page on this machine alone elsewhere."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from tactile_cube.errors import InputError

LOOPBACK = "127.0.0.1"
VIEWERS = ("auto", "window", "web", "none")


def require_viewer(wanted: str) -> None:
    """Refuse what is no viewer.

    Raises:
        InputError: it is none of `VIEWERS`.
    """
    if wanted not in VIEWERS:
        raise InputError(f"viewer={wanted}: choose one of {', '.join(VIEWERS)}")


def show_files(files: Sequence[Path], wanted: str) -> str:
    """Open recordings as wanted; says in words where they are to be seen.

    What is started is bound to the loopback interface, outlives the program, and Ctrl-C does not reach it.

    Args:
        files: recordings, `.rrd`.
        wanted: "window", "web", "none", or "auto": a window where there is a display, else none.

    Raises:
        InputError: another viewer.
    """
    require_viewer(wanted)
    if wanted == "auto":
        wanted = "window" if _has_display() else "none"
    if wanted == "none":
        named = " ".join(map(str, files))
        return f"to look at it: rerun {named} (or viewer=web: a page for a browser on this machine)"
    port, web_port = _free_port(), _free_port()
    # Without --bind it would be open to the whole network.
    words = [sys.executable, "-m", "rerun", "--bind", LOOPBACK, "--port", str(port)]
    if wanted == "web":
        words += ["--serve-web", "--web-viewer-port", str(web_port), "--server-memory-limit", "500MB"]
    silent = subprocess.DEVNULL
    process = subprocess.Popen(
        [*words, *map(str, files)], stdin=silent, stdout=silent, stderr=silent, start_new_session=True
    )
    if wanted == "window":
        return "opening the Rerun viewer"
    page = f"http://{LOOPBACK}:{web_port}?url={quote(f'rerun+http://{LOOPBACK}:{port}/proxy', safe='')}"
    return f"look at {page} ; the server goes on until: kill -- -{process.pid}"


def _has_display() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _free_port() -> int:
    with socket.socket() as tried:
        tried.bind((LOOPBACK, 0))
        return int(tried.getsockname()[1])
