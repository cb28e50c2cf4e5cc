"""Which viewer is opened, and that it is bound to the loopback interface."""

from pathlib import Path
from typing import Any

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
