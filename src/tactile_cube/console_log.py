"""What a command shows on the console, kept in its folder."""

import contextlib
import re
import shlex
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

_ENDS = re.compile(r"[\r\n]+")
_STYLE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


class KeptStream:
    """A stream whose lines also go to a file, without colours; of a line shown in place, every state is one.

    Args:
        stream: shown.
        file: kept.
    """

    def __init__(self, stream: TextIO, file: TextIO):
        self._stream, self._file, self._begun = stream, file, ""

    def __getattr__(self, name: str) -> Any:
        """All else is the stream's."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Show and keep."""
        *lines, self._begun = _ENDS.split(self._begun + text)
        self._keep(lines)
        return self._stream.write(text)

    def end(self) -> None:
        """Keep a last line that did not end, and show what waits."""
        self._keep([self._begun])
        self._stream.flush()

    def _keep(self, lines: list[str]) -> None:
        plain = [_STYLE.sub("", line).rstrip() for line in lines]
        with contextlib.suppress(OSError):  # a full disk stops what the command writes, not what it says
            self._file.writelines(f"{line}\n" for line in plain if line)
            self._file.flush()


@contextlib.contextmanager
def console_kept_in(path: Path) -> Iterator[None]:
    """Append all that is printed to a file, under a line with the time and the command."""
    with path.open("a", encoding="utf-8") as file:
        file.write(f"--- {time.strftime('%Y-%m-%d %H:%M:%S')} {shlex.join(sys.argv)}\n")
        file.flush()  # worker processes inherit what is not written yet
        streams = sys.stdout, sys.stderr
        kept = [KeptStream(stream, file) for stream in streams]
        sys.stdout, sys.stderr = kept
        try:
            yield
        finally:
            sys.stdout, sys.stderr = streams
            for stream in kept:
                stream.end()
