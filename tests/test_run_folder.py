"""The log of a run holds what its console showed."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.cli import PIPE_CLOSED
from tactile_cube.compiled import borrowed, compiled, shaped_view
from tactile_cube.run_folder import console_kept_in
from tactile_cube.whole_file import write_whole


def test_lines_errors_and_lines_in_place_are_kept_without_colours(tmp_path, capsys) -> None:
    log = tmp_path / "train.log"
    with console_kept_in(log):
        print("starts")
        print("\r\x1b[K1 k steps", end="")
        print("\r\x1b[K\x1b[1m2 k steps\x1b[0m", end="")
        print("error: full", file=sys.stderr)
    shown = capsys.readouterr()
    assert shown.out.startswith("starts\n\r\x1b[K1 k steps")
    assert shown.err == "error: full\n"
    head, *lines = log.read_text().splitlines()
    assert head.startswith("--- ")
    assert sorted(lines) == ["1 k steps", "2 k steps", "error: full", "starts"]
    print("after")
    assert "after" not in log.read_text()


def test_the_next_session_appends(tmp_path: Path) -> None:
    for word in ("first", "second"):
        with console_kept_in(tmp_path / "a.log"):
            print(word)
    assert [line for line in (tmp_path / "a.log").read_text().splitlines() if line[0] != "-"] == ["first", "second"]


def test_a_reader_that_leaves_ends_the_command_without_a_word(tmp_path: Path) -> None:
    talks = (
        "from pathlib import Path; from tactile_cube.run_folder import console_kept_in\n"
        "from tactile_cube.cli import quiet_when_nobody_reads\n"
        f"with quiet_when_nobody_reads(), console_kept_in(Path({str(tmp_path / 'talk.log')!r})):\n"
        "    for line in range(100_000): print('line', line)\n"
    )
    with subprocess.Popen([sys.executable, "-c", talks], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as talker:
        assert talker.stdout is not None
        assert talker.stderr is not None
        assert talker.stdout.readline() == b"line 0\n"
        talker.stdout.close()
        assert talker.stderr.read() == b""
    assert talker.returncode == PIPE_CLOSED
    assert "line 0\n" in (tmp_path / "talk.log").read_text()


def test_contents_and_mode(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a", b"one ", memoryview(b"two"))
    finally:
        os.umask(before)
    assert (tmp_path / "a").read_bytes() == b"one two"
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_write_that_fails_leaves_what_was_there_and_nothing_else(tmp_path: Path) -> None:
    write_whole(tmp_path / "a", b"before")
    with pytest.raises(TypeError):
        write_whole(tmp_path / "a", b"half", "no bytes")  # type: ignore[arg-type]
    assert (tmp_path / "a").read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_link_in_the_place_of_the_draft_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "other").write_text("theirs")
    (tmp_path / "a.partial").symlink_to(tmp_path / "other")
    write_whole(tmp_path / "a", b"mine")
    assert (tmp_path / "other").read_text() == "theirs"
    assert (tmp_path / "a").read_bytes() == b"mine"


BORROWED = [borrowed, compiled(lambda array: borrowed(array))]
SHAPED_VIEW = [shaped_view, compiled(lambda array, start, shape: shaped_view(array, start, shape))]


@pytest.mark.parametrize("view", BORROWED)
def test_a_borrowed_array_is_the_same_memory(view: Callable[..., Any]) -> None:
    array = np.arange(5.0)
    alias = view(array)
    alias[2] = 7.0
    assert array[2] == 7.0


@pytest.mark.parametrize("view", BORROWED)
def test_an_array_with_gaps_cannot_be_borrowed(view: Callable[..., Any]) -> None:
    with pytest.raises(ValueError, match="contiguous"):
        view(np.zeros(10)[::2])


@pytest.mark.parametrize("view", SHAPED_VIEW)
def test_a_shaped_view_is_the_same_memory_from_its_start_on(view: Callable[..., Any]) -> None:
    array = np.arange(10.0)
    part = view(array, 3, (2, 3))
    np.testing.assert_array_equal(part, [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]])
    part[1, 0] = -1.0
    assert array[6] == -1.0
