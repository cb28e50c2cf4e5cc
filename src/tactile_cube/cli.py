"""The wrapper that all commands share: quick help, configuration by Hydra, and errors in one line.

A command is a module of this package with a function decorated by `command`; it imports nothing slow at its top, so
that `--help` and `--cfg job` answer at once.
"""

import contextlib
import errno
import functools
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from tactile_cube.command_help import CONFIG, RECIPE, help_text, install_script, prepare_query
from tactile_cube.composition import refuse_unknown_keys
from tactile_cube.console_log import console_kept_in
from tactile_cube.did_you_mean import near_key, near_option
from tactile_cube.errors import InputError
from tactile_cube.run_folder import INTERRUPTED, USAGE_ERROR, configuration_in

if TYPE_CHECKING:
    from omegaconf import DictConfig

Kinds = type[BaseException] | tuple[type[BaseException], ...]
UNEXPECTED = re.compile(r"(\w+)\.__init__\(\) got an unexpected keyword argument '(\w+)'.*full_key: ([\w.]+)")
"""How Hydra says that a class does not take a value."""
PIPE_CLOSED = 141
"""Exit status of a program that writes to a closed pipe, as shells count it: 128 + SIGPIPE."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
NOT_AN_OPTION = Path("hydra", "_internal", "defaults_list.py")
"""Where Hydra fails at `task=1` (a ValueError) and `task=[1]` (a TypeError), with errors that are none of its own."""


def command(
    name: str, after_sweep: Callable[[list[Path]], None] = lambda folders: None
) -> Callable[[Callable[["DictConfig"], None]], Callable[[], None]]:
    """Make a function of a configuration a command line of its own.

    Args:
        name: of the command; its configuration is conf/<name>.yaml.
        after_sweep: says what came of a sweep, given its folders.

    Example:
        >>> @command("train")
        ... def main(config: DictConfig) -> None: ...
    """

    def decorate(function: Callable[["DictConfig"], None]) -> Callable[[], None]:
        @functools.wraps(function)
        @quiet_when_nobody_reads()
        def main() -> None:
            if {"--help", "-h"} & set(sys.argv[1:]):
                print(help_text(name))
                return
            script = install_script(sys.argv[1:])
            if script is not None:
                print(script)
                return
            prepare_query()
            sys.argv = with_recipe(name, sys.argv)
            _run(name, function, after_sweep)

        return main

    return decorate


@contextlib.contextmanager
def quiet_when_nobody_reads() -> Iterator[None]:
    """End without a traceback when the reader of a pipe leaves, as in `--help | head`."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more when it ends
        sys.exit(PIPE_CLOSED)


def with_recipe(name: str, words: list[str]) -> list[str]:
    """The words of a command line, with the command's recipe in front of the first `key=value` unless they choose one.

    Example:
        >>> with_recipe("train", ["train", "seed=1", "--cfg", "job"])
        ['train', '+experiment=curriculum', 'seed=1', '--cfg', 'job']
    """
    chosen = any(re.match(r"[+~]*experiment\b", word) for word in words)
    if name not in RECIPE or chosen or {"-sc", "--shell-completion"} & set(words):
        return words
    first = next((at for at, word in enumerate(words) if re.match(r"[+~]*[\w./@]+=", word)), len(words))
    return [*words[:first], f"+experiment={RECIPE[name]}", *words[first:]]


def _run(name: str, function: Callable[["DictConfig"], None], after_sweep: Callable[[list[Path]], None]) -> None:
    import hydra

    from tactile_cube.sweep import Jobs  # imports Hydra

    wants_traceback = os.environ.get("HYDRA_FULL_ERROR", "0") != "0"
    os.environ["HYDRA_FULL_ERROR"] = "1"  # else Hydra prints errors in its own way and exits with status 1
    with _errors_in_one_line(wants_traceback):
        jobs = Jobs(functools.partial(_guarded, name, function, wants_traceback))

        @functools.wraps(function)
        def task(config: "DictConfig") -> None:
            jobs(config)

        try:
            hydra.main(version_base="1.3", config_path=str(CONFIG.resolve()), config_name=name)(task)()
        finally:
            swept = jobs.ended()
        if swept:
            after_sweep([folder for folder, good in swept.items() if good])
        failed = [str(folder) for folder, good in swept.items() if not good]
        if failed:
            print(f"{len(failed)} of {len(swept)} runs failed: {', '.join(failed)}", file=sys.stderr)
            sys.exit(1)


def _guarded(
    name: str, function: Callable[["DictConfig"], None], wants_traceback: bool, config: "DictConfig", folder: Path
) -> None:
    """One job, its errors in one line: inside Hydra, which otherwise adds lines of its own."""
    log = folder / f"{name}.log"
    configuration = configuration_in(folder, config, log.name)
    with configuration, console_kept_in(log), _errors_in_one_line(wants_traceback):
        refuse_unknown_keys(name, config)
        function(config)


@contextlib.contextmanager
def _errors_in_one_line(wants_traceback: bool) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except Exception as error:
        message = None if wants_traceback else usage_error(error)
        if message is None:
            raise
        fail(message)


def usage_error(error: BaseException) -> str | None:
    """What the user did wrong, in one line; None if the error is none of the user's."""
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException
    from pydantic import ValidationError

    for kinds in (InputError, ValidationError, (HydraException, OmegaConfBaseException)):
        cause = _find(error, kinds)
        if cause is not None:
            return _one_line(cause)
    plain = _find(error, (TypeError, ValueError))
    if plain is not None and _raised_in(plain, NOT_AN_OPTION):
        return f"a choice from a group of conf/ is the name of a file there, e.g. task=table: {_one_line(plain)}"
    full = _find(error, OSError)
    if isinstance(full, OSError) and full.errno in FULL:
        return (
            f"{full.filename or 'output'}: the disk is full; free some of it, or write elsewhere with hydra.run.dir=DIR"
        )
    return None


def fail(message: str) -> NoReturn:
    """One line on stderr, exit code 2."""
    print(f"error: {message}", file=sys.stderr)
    sys.exit(USAGE_ERROR)


def _find(error: BaseException | None, kinds: Kinds) -> BaseException | None:
    """The first error of some kind among an error and its causes."""
    while error is not None:
        if isinstance(error, kinds):
            return error
        error = error.__cause__ or error.__context__
    return None


def _raised_in(error: BaseException, file: Path) -> bool:
    frames = traceback.extract_tb(error.__traceback__)
    return bool(frames) and Path(frames[-1].filename).parts[-len(file.parts) :] == file.parts


def _one_line(error: BaseException) -> str:
    from pydantic import ValidationError

    if isinstance(error, ValidationError):
        return "; ".join(_describe(error.title, dict(entry)) for entry in error.errors())
    # Hydra appends where it searched, which nobody asked for
    text = " ".join(str(error).partition("Config search path:")[0].split())
    return _superfluous(text) or (text or type(error).__name__) + near_option(error)


def _superfluous(text: str) -> str | None:
    """What to do about a value that the chosen entry of a group does not take, as an experiment sets it for another."""
    found = UNEXPECTED.search(text)
    if found is None:
        return None
    kind, key, place = found.groups()
    group = place.removeprefix("env.")
    place = group if (CONFIG / group).is_dir() else place
    name = f"{place}.{key}"
    return f"{name}: {kind} has no {key}, which was set for another choice of {place}; take it out with ~{name}"


def _describe(title: str, entry: dict[str, Any]) -> str:
    group = title.removesuffix("Settings").lower()
    prefix = [] if group == "run" else [group]  # the run's own settings stand at the top
    key = ".".join([*prefix, *(str(part) for part in entry["loc"])])
    message = str(entry["msg"]).removeprefix("Value error, ")
    if entry["type"] == "extra_forbidden":
        return f"{key}: no such setting{near_key(key)}"
    return f"{key}={entry['input']}: {message}" if entry["loc"] else f"{group}: {message}"
