"""A command line that is given in this process, where a start of Python would cost more than the command."""

import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from tactile_cube.cli import command_line


class Said(NamedTuple):
    """Named as `subprocess` does."""

    returncode: int
    stdout: str
    stderr: str


def typed(command: str, *words: str, folder: Path | str = ".") -> Said:
    """Status and output of a command in a folder."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.chdir(folder)
        patch.setattr(sys, "argv", [command, *words])
        try:
            command_line(command)()
        except SystemExit as ended:
            status = int(ended.code or 0)
    return Said(status, out.getvalue(), err.getvalue())
