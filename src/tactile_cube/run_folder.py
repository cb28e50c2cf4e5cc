"""A run's folder says how it was made and what the console showed; a command that is refused leaves it as it was."""

from __future__ import annotations

import contextlib
import re
import shlex
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from tactile_cube.whole_file import write_whole

if TYPE_CHECKING:
    from omegaconf import DictConfig

CONFIGURATION, CHECKPOINT = ".hydra", "checkpoint.pt"
USAGE_ERROR = 2  # exit status of a command that was refused
INTERRUPTED = 130  # exit status after Ctrl-C


@contextlib.contextmanager
def configuration_in(folder: Path, config: DictConfig, log: str) -> Iterator[None]:
    """Write the configuration of a command into its folder, and take it back if the command is refused.

    Hydra would write it over that of an earlier run before anybody can refuse. A folder in which nothing else than
    `log` was written goes altogether.
    """
    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf

    place, hydra = folder / CONFIGURATION, HydraConfig.instance().cfg
    before = {path: path.read_bytes() for path in place.glob("*.yaml")}
    place.mkdir(parents=True, exist_ok=True)
    parts = {"config": config, "hydra": hydra, "overrides": HydraConfig.get().overrides.task}
    for name, text in {name: OmegaConf.to_yaml(part) for name, part in parts.items()}.items():
        write_whole(place / f"{name}.yaml", text.encode())
    try:
        yield
    except SystemExit as refusal:
        if refusal.code == USAGE_ERROR:
            for path, content in before.items():
                write_whole(path, content)
            if not before:
                shutil.rmtree(place, ignore_errors=True)
                written = {path.name for path in folder.iterdir()} - {".lock", log}
                if not written and folder.resolve() != Path.cwd():
                    shutil.rmtree(folder, ignore_errors=True)
        raise


_ENDS = re.compile(r"[\r\n]+")
_STYLE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


class KeptStream:
    """Stream whose lines also go to a file, without colours; each state of a line shown in place is a line there.

    Args:
        stream: shown.
        file: kept.
    """

    def __init__(self, stream: TextIO, file: TextIO):
        self._stream, self._file, self._begun = stream, file, ""

    def __getattr__(self, name: str) -> Any:
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
