"""Which viewer is opened, and that it is bound to the loopback interface."""

import contextlib
import os
import time
from pathlib import Path
from typing import Any

import psutil
import pytest

from tactile_cube.errors import InputError
from tactile_cube.visualization import viewer


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Command lines of the viewers that would have been started."""
    commands: list[list[str]] = []

    class Process:
        pid = 1

        def __init__(self, words: list[str], **_: Any) -> None:
            commands.append(words)

    monkeypatch.setattr("subprocess.Popen", Process)
    return commands


@pytest.mark.parametrize(("display", "expected"), [({"DISPLAY": ":0"}, 1), ({"WAYLAND_DISPLAY": "w"}, 1), ({}, 0)])
def test_a_window_opens_where_there_is_a_display_and_else_the_command_is_told(
    started: list[list[str]], monkeypatch: pytest.MonkeyPatch, display: dict[str, str], expected: int
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for name, value in display.items():
        monkeypatch.setenv(name, value)
    said = viewer.show_files([Path("a.rrd")], "auto")
    assert len(started) == expected
    assert ("rerun a.rrd" in said) == (not expected)


@pytest.mark.parametrize("wanted", ["web", "window"])
def test_whatever_is_opened_listens_to_this_machine_alone(started: list[list[str]], wanted: str) -> None:
    said = viewer.show_files([Path("a.rrd")], wanted)
    (words,) = started
    assert words[words.index("--bind") + 1] == "127.0.0.1"
    assert words[-1] == "a.rrd"
    assert ("http://127.0.0.1:" in said) == (wanted == "web")


def test_nothing_is_opened_unless_asked_for(started: list[list[str]]) -> None:
    assert "rerun a.rrd b.rrd" in viewer.show_files([Path("a.rrd"), Path("b.rrd")], "none")
    assert not started


def test_what_is_no_viewer_is_refused() -> None:
    with pytest.raises(InputError, match="viewer=tv: choose one of auto, window, web, none"):
        viewer.show_files([], "tv")


def test_when_a_viewer_is_ended_nothing_of_it_goes_on() -> None:
    page = viewer.start_viewer(True)
    deadline = time.monotonic() + 60.0
    while len(group(page.process.pid)) < 2 and time.monotonic() < deadline:  # module and program
        time.sleep(0.05)
    assert len(group(page.process.pid)) == 2
    page.end()
    while group(page.process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert group(page.process.pid) == []
    page.end()


def group(leader: int) -> list[int]:
    """Processes of a group that run."""
    running = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.NoSuchProcess, ProcessLookupError):
            if os.getpgid(process.pid) == leader and process.status() != psutil.STATUS_ZOMBIE:
                running.append(process.pid)
    return running
