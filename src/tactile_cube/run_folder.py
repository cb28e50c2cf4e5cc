"""A run's folder says how it was made; a command that is refused leaves it as it was."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_cube.whole_file import write_whole

if TYPE_CHECKING:
    from omegaconf import DictConfig

CONFIGURATION = ".hydra"
USAGE_ERROR = 2
"""Exit status of a command that was refused."""
INTERRUPTED = 130
"""Exit status after Ctrl-C."""


@contextlib.contextmanager
def configuration_in(folder: Path, config: DictConfig, log: str) -> Iterator[None]:
    """Write the configuration of a command into its folder, and take it back if the command is refused.

    Hydra would write it over that of an earlier run before anybody can refuse. A folder in which nothing else was
    written goes altogether.

    Args:
        folder: of the run.
        config: of the command.
        log: name of the file in the folder that keeps what the console showed.
    """
    place = folder / CONFIGURATION
    before = {path: path.read_bytes() for path in place.glob("*.yaml")}
    place.mkdir(parents=True, exist_ok=True)
    for name, text in _configuration(config).items():
        write_whole(place / name, text.encode())
    try:
        yield
    except SystemExit as refusal:
        if refusal.code == USAGE_ERROR:
            for path, content in before.items():
                write_whole(path, content)
            if not before:
                _remove(folder, log)
        raise


def _configuration(config: DictConfig) -> dict[str, str]:
    """The files that Hydra would write, and their content."""
    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf

    own = HydraConfig.instance().cfg
    parts = {"config": config, "hydra": own, "overrides": HydraConfig.get().overrides.task}
    return {f"{name}.yaml": OmegaConf.to_yaml(part) for name, part in parts.items()}


def _remove(folder: Path, log: str) -> None:
    shutil.rmtree(folder / CONFIGURATION, ignore_errors=True)
    written = {path.name for path in folder.iterdir()} - {".lock", log}
    if not written and folder.resolve() != Path.cwd():
        shutil.rmtree(folder, ignore_errors=True)
