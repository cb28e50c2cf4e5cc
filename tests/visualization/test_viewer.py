"""Whether a viewer is opened, and that it is bound to the loopback interface."""

from pathlib import Path
from typing import Any

import pytest

from tactile_cube.visualization import rerun_recording


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
    said = rerun_recording.show_files([Path("a.rrd")], "auto")
    assert len(started) == expected
    assert ("rerun a.rrd" in said) == (not expected)


def test_what_is_opened_listens_to_this_machine_alone_and_nothing_is_unless_asked_for(started: list[list[str]]) -> None:
    rerun_recording.show_files([Path("a.rrd")], "window")
    (words,) = started
    assert words[words.index("--bind") + 1] == "127.0.0.1"
    assert words[-1] == "a.rrd"
    assert "rerun a.rrd b.rrd" in rerun_recording.show_files([Path("a.rrd"), Path("b.rrd")], "none")
    assert len(started) == 1
