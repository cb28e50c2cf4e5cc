"""The log of a run holds what its console showed."""

import subprocess
import sys
from pathlib import Path

import pytest

from tactile_cube.cli import PIPE_CLOSED
from tactile_cube.run_folder import console_kept_in


def test_lines_errors_and_lines_in_place_are_kept_without_colours(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
