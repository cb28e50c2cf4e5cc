"""One call of a command, from a command line or a program: settings, folder, and the words that ask for it."""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import re
import shlex
import sys
import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from tactile_cube.composition import CONFIG, composed, refuse_unknown_keys, suggestion, with_recipe
from tactile_cube.errors import InputError
from tactile_cube.usage_error import usage_error

if TYPE_CHECKING:
    from omegaconf import DictConfig

Say = Callable[[str], None]  # takes lines of progress, as `print` does
shown_at_once: Say = functools.partial(print, flush=True)
PathLike = str | Path
NO_KEYS = ("values", "folder", "say")  # keywords of calls that are no keys of the configuration
EFFECTS = ("effects", "own_effects", "hidden")  # keys of the configuration that name effects


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
        """Print a line of progress to stderr, with the time."""
        print(f"[{time.perf_counter() - self.began:5.1f} s] {line}", file=sys.stderr, flush=True)


def typed_job(config: DictConfig) -> Job:
    """Return the job of the command line of this process.

    Raises:
        InputError: a class of effects that the configuration names cannot be imported.
    """
    from hydra.core.hydra_config import HydraConfig

    hydra = HydraConfig.get()
    return _job(config, hydra, str(hydra.job.config_name), sys.argv[1:], hydra.runtime.output_dir)


def called_job(command: str, given: Mapping[str, Any]) -> Job:
    """Return the job of a call from a program.

    Args:
        command: its name.
        given: the call's keywords, which are the command's keys and groups; None: as conf/ says. Beside them `values`
            (dotted key -> value), `folder`, where files go, and `say`. A recording is named by its folder, a model
            without a file by its rig.

    Raises:
        InputError: as `typed_job`, a key that the command does not have, or a setting where a value is expected.
    """
    settings = settings_of(given)
    for key, value in settings.items():
        _refuse_setting(command, key, value, given)
    words = [as_word(key, value) for key, value in settings.items()]
    return worded_job(command, words, given.get("folder"))


def settings_of(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys and groups of the configuration, and what a call's keywords set them to."""
    keywords = {key: value for key, value in given.items() if key not in NO_KEYS and value is not None}
    return keywords | dict(given.get("values") or {})


def worded_job(command: str, words: Sequence[str], folder: PathLike | None = None) -> Job:
    """Return the job of a command line's words; `folder`: where its files go, None: the command's default folder."""
    from omegaconf import OmegaConf

    config = composed(command, with_recipe(command, [*words]), with_hydra=True)
    refuse_unknown_keys(command, config)
    hydra, place = config.hydra, config.hydra.run.dir if folder is None else folder
    OmegaConf.set_struct(config, False)
    del config["hydra"]
    OmegaConf.set_struct(config, True)
    return _job(config, hydra, command, words, place)


def as_word(key: str, value: Any) -> str:
    """Return the command-line override that sets a key to a value.

    Example:
        >>> as_word("effects", ["backlash@q2: play=0.05"])
        "effects=['backlash@q2: play=0.05']"
    """
    if not re.fullmatch(r"[+~]*[\w./@]+", key):
        raise InputError(f"{key!r}: no key of the configuration; give a dotted name, e.g. 'task.filter_time'")
    if key.startswith("~"):  # takes the key out
        return key
    return f"{'+' if key == 'experiment' else ''}{key}={_in_words(value)}"


def _in_words(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{key}:{_in_words(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ",".join(map(_in_words, value)) + "]"
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    if isinstance(value, numbers.Real):
        return str(value)
    model = hasattr(value, "rig") and not hasattr(value, "folder")
    text = f"model of {value.rig}" if model else str(getattr(value, "folder", value))
    if re.fullmatch(r"[A-Za-z_/][\w./@-]*", text) and text.lower() not in ("null", "true", "false", "nan", "inf"):
        return text
    from hydra.core.override_parser.types import Quote, QuotedString

    return QuotedString(text.replace("${", r"\${"), Quote.single).with_quotes()


def _refuse_setting(command: str, key: str, value: Any, known: Container[str]) -> None:
    """Refuse a setting where a value is due: it would be taken for a file of that name."""
    found = re.match(r"[+~]*(\w+)[\w./@]*=", value) if isinstance(value, str) else None
    if found and (found[1] in known or (CONFIG / found[1]).is_dir()):
        raise InputError(
            f"{command}: {key}={value!r} is a setting where the value of {key} is due; give settings as "
            f"keywords, e.g. seed=1; a file of that name is pathlib.Path({value!r})"
        )


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
    """Yield the values of the keys that name effects, anywhere in a tree."""
    for key, value in part.items() if isinstance(part, dict) else []:
        if key == "agent":  # its hidden layers are no effects
            continue
        if key in EFFECTS and value is not None:
            if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
                raise InputError(f"{key}={value}: expected a list of names: '{key}=[NAME@JOINT]'")
            yield from value
        yield from _effects(value)


Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def as_input_errors(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Wrap a function to raise as `InputError` every error that the command line reports in one line.

    Hydra's own errors, those of pydantic and those wrapped in either have many more lines.
    """
    keywords = inspect.signature(function).parameters

    @functools.wraps(function)
    def told(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        for key in kwargs.keys() - keywords.keys():
            near = suggestion(key, keywords)
            raise InputError(f"{key}: no such setting of {function.__name__}; help() lists them{near}")
        try:
            return function(*args, **kwargs)
        except Exception as error:
            message = usage_error(error)
            if message is None or (isinstance(error, InputError) and message == str(error)):
                raise
            raise InputError(message) from error

    return told
