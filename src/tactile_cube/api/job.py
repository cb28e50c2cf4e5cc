"""One call of a command, from a command line or a program: settings, folder, and the words that ask for it."""

from __future__ import annotations

import functools
import math
import re
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from tactile_cube.command_help import CONFIG
from tactile_cube.composition import composed, refuse_unknown_keys, with_recipe
from tactile_cube.errors import InputError
from tactile_cube.usage_error import usage_error

if TYPE_CHECKING:
    from omegaconf import DictConfig

Say = Callable[[str], None]
"""Takes lines of progress, as `print` does."""
shown_at_once: Say = functools.partial(print, flush=True)
PathLike = str | Path
EFFECTS = ("effects", "own_effects", "hidden")
"""Keys of the configuration that name effects."""


@dataclass(frozen=True)
class Job:
    """One call of a command.

    Attributes:
        command: the words on a command line that ask for the same.
        choices: group -> chosen option.
        words: of the command line, without those that are Hydra's own.
        began: by `time.perf_counter` [s].
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
    """The job that a command line asks for.

    Raises:
        InputError: a class of effects that the configuration names cannot be imported.
    """
    from hydra.core.hydra_config import HydraConfig

    hydra = HydraConfig.get()
    return _job(config, hydra, str(hydra.job.config_name), sys.argv[1:], hydra.runtime.output_dir)


def called_job(command: str, settings: Sequence[str], folder: PathLike | None = None, **given: Any) -> Job:
    """The job that a call from a program asks for.

    Args:
        command: its name.
        settings: choices and values as on the command line.
        folder: where its files go; None: where the command would put them.
        given: values of the command's keys, whatever characters they have; None: as `settings` say. A recording goes
            by its folder, a model that is no file by its rig.

    Raises:
        InputError: as `typed_job`, a setting that the command does not have, or one in the place of a value.
    """
    from omegaconf import OmegaConf

    words = list(settings)
    config = composed(command, with_recipe(command, words), with_hydra=True)
    refuse_unknown_keys(command, config)
    for key, value in given.items():
        if value is not None:
            _refuse_setting(command, key, value, config)
            named = value if isinstance(value, list) else _name(value)
            OmegaConf.update(config, key, named)
            words.append(f"{key}={named}")
    hydra, place = config.hydra, config.hydra.run.dir if folder is None else folder
    OmegaConf.set_struct(config, False)
    del config["hydra"]
    OmegaConf.set_struct(config, True)
    return _job(config, hydra, command, words, place)


def _refuse_setting(command: str, key: str, value: Any, config: DictConfig) -> None:
    """Refuse a setting where a value is due: it would be taken for a file of that name."""
    found = re.match(r"[+~]*(\w+)[\w./@]*=", value) if isinstance(value, str) else None
    if found and (found[1] in set(config) or (CONFIG / found[1]).is_dir()):
        raise InputError(
            f"{command}: {key}={value!r} is a setting where the value of {key} is due: give {key} first, without "
            f"'{key}=', and settings after it; a file of that name is pathlib.Path({value!r})"
        )


def _name(thing: Any) -> str:
    if hasattr(thing, "rig") and not hasattr(thing, "folder"):
        return f"model of {thing.rig}"
    return str(getattr(thing, "folder", thing))


def _job(config: DictConfig, hydra: Any, command: str, words: Sequence[str], folder: PathLike) -> Job:
    from omegaconf import OmegaConf

    # the user's own classes are imported: it is the user who names them here, as no file does
    names = [name for name in _effects(OmegaConf.to_container(config)) if "." in name.partition(":")[0]]
    if names:
        from tactile_cube.drivetrain.effects import import_own_effects  # imports slowly

        import_own_effects(names)
    step, seed = config.get("step"), config.get("seed", 0)
    if step is not None and not (isinstance(step, int | float) and 0.0 < step < math.inf):
        raise InputError(f"step={step}: give a finite number of seconds above 0")
    if isinstance(seed, bool) or not (isinstance(seed, int) and 0 <= seed < 2**63):
        raise InputError(f"seed={seed}: give a whole number from 0 to {2**63 - 1}")
    text = shlex.join(["python", "-m", f"tactile_cube.{command}", *words])
    return Job(config, Path(folder), text, dict(hydra.runtime.choices), tuple(hydra.overrides.task))


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
