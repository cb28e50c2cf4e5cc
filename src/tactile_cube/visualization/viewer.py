"""The Rerun viewer beside a program."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

VIEWERS = ("auto", "window", "none")


def show_files(files: Sequence[Path], wanted: str) -> str:
    """Open recordings in a window; says in words where they are to be seen.

    The window outlives the program, and Ctrl-C does not reach it.

    Args:
        files: recordings, `.rrd`.
        wanted: "window", "none", or "auto": a window where there is a display, else none.
    """
    display = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if wanted == "none" or (wanted == "auto" and not display):
        return f"to look at it: rerun {' '.join(map(str, files))} (in a browser: --web-viewer --bind 127.0.0.1)"
    words = [sys.executable, "-m", "rerun", "--bind", "127.0.0.1"]  # else it would be open to the whole network
    silent = subprocess.DEVNULL
    subprocess.Popen([*words, *map(str, files)], stdin=silent, stdout=silent, stderr=silent, start_new_session=True)
    return "opening the Rerun viewer"
