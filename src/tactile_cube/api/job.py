"""One call of a command, from a command line or a program: settings, folder, and the words that ask for it."""

from __future__ import annotations

import functools
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from tactile_cube.cli import usage_error, with_recipe
from tactile_cube.composition import composed, refuse_unknown_keys
from tactile_cube.errors import InputError

if TYPE_CHECKING:
    from omegaconf import DictConfig

Say = Callable[[str], None]
"""Takes lines of progress, as `print` does."""
PathLike = str | Path
EFFECTS = ("effects", "own_effects", "hidden")
"""Keys of the configuration that name effects."""


@dataclass(frozen=True)
class Job:
    """One call of a command.

    Attributes:
        config: its configuration.
        folder: where its files go.
        command: the words on a command line that ask for the same.
        choices: group -> chosen option.
        words: of the command line, without those that are Hydra's own.
        began: when it began, by `time.perf_counter` [s].
    """

    config: DictConfig
    folder: Path
    command: str
    choices: Mapping[str, str | None]
    words: tuple[str, ...] = ()
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

    import_named_effects(config)
    hydra = HydraConfig.get()
    words = ["python", "-m", f"tactile_cube.{hydra.job.config_name}", *sys.argv[1:]]
    own = tuple(hydra.overrides.task)
    return Job(config, Path(hydra.runtime.output_dir), shlex.join(words), dict(hydra.runtime.choices), own)


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
    refuse_unknown_keys(command, config)
    for key, value in given.items():
        if value is not None:
            OmegaConf.update(config, key, value)
            words.append(f"{key}={value}")
    import_named_effects(config)
    target = Path(config.hydra.run.dir if folder is None else folder)
    choices, own = dict(config.hydra.runtime.choices), tuple(config.hydra.overrides.task)
    OmegaConf.set_struct(config, False)
    del config["hydra"]
    OmegaConf.set_struct(config, True)
    return Job(config, target, shlex.join(["python", "-m", f"tactile_cube.{command}", *words]), choices, own)


def import_named_effects(config: DictConfig) -> None:
    """Import the user's own classes of effects that a configuration names; it is the user's, as no file's is.

    Raises:
        InputError: one that cannot be imported.
    """
    from omegaconf import OmegaConf

    names = [name for name in _effects(OmegaConf.to_container(config)) if "." in name.partition(":")[0]]
    if names:
        from tactile_cube.drivetrain.effects import import_own_effects  # imports slowly

        import_own_effects(names)


def _effects(part: Any) -> Iterator[str]:
    """What stands at the keys that name effects, anywhere in a tree."""
    for key, value in part.items() if isinstance(part, dict) else []:
        if key in EFFECTS and isinstance(value, list):
            yield from (name for name in value if isinstance(name, str))
        yield from _effects(value)


Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def as_input_errors(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """The function with everything that the command line would tell in one line raised as an `InputError`.

    Hydra's own errors, those of pydantic and those wrapped in either say the same in many more lines.
    """

    @functools.wraps(function)
    def told(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        try:
            return function(*args, **kwargs)
        except Exception as error:
            message = usage_error(error)
            if message is None or (isinstance(error, InputError) and message == str(error)):
                raise
            raise InputError(message) from error

    return told
