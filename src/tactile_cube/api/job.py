"""One call of a command, from a command line or a program: settings, folder, and the words that ask for it."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_cube.cli import with_recipe
from tactile_cube.composition import composed

if TYPE_CHECKING:
    from omegaconf import DictConfig

Say = Callable[[str], None]
"""Takes lines of progress, as `print` does."""
PathLike = str | Path


@dataclass(frozen=True)
class Job:
    """One call of a command.

    Attributes:
        config: its configuration.
        folder: where its files go.
        command: the words on a command line that ask for the same.
        choices: group -> chosen option.
        began: when it began, by `time.perf_counter` [s].
    """

    config: DictConfig
    folder: Path
    command: str
    choices: Mapping[str, str | None]
    began: float = field(default_factory=time.perf_counter)

    @property
    def seconds(self) -> float:
        """How long it has been running [s]."""
        return round(time.perf_counter() - self.began, 2)

    def say(self, line: str) -> None:
        """A line of progress on stderr, with the time."""
        print(f"[{time.perf_counter() - self.began:5.1f} s] {line}", file=sys.stderr, flush=True)


def typed_job(config: DictConfig) -> Job:
    """The job that a command line asks for."""
    from hydra.core.hydra_config import HydraConfig

    hydra = HydraConfig.get()
    words = ["python", "-m", f"tactile_cube.{hydra.job.config_name}", *sys.argv[1:]]
    return Job(config, Path(hydra.runtime.output_dir), shlex.join(words), dict(hydra.runtime.choices))


def called_job(command: str, settings: tuple[str, ...], folder: PathLike | None = None, **given: Any) -> Job:
    """The job that a call from a program asks for.

    Args:
        command: its name.
        settings: choices and values as on the command line.
        folder: where its files go; None: where the command would put them.
        given: values of the command's keys, whatever characters they have; None: as `settings` say.
    """
    from omegaconf import OmegaConf

    words = list(settings)
    config = composed(command, with_recipe(command, words), with_hydra=True)
    for key, value in given.items():
        if value is not None:
            OmegaConf.update(config, key, value)
            words.append(f"{key}={value}")
    target = Path(config.hydra.run.dir if folder is None else folder)
    choices = dict(config.hydra.runtime.choices)
    OmegaConf.set_struct(config, False)
    del config["hydra"]
    OmegaConf.set_struct(config, True)
    return Job(config, target, shlex.join(["python", "-m", f"tactile_cube.{command}", *words]), choices)
