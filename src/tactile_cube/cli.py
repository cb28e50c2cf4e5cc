"""The command lines: quick help, configuration by Hydra, and errors in one line.

Nothing slow is imported before a command runs, so that `--help` and `--cfg job` answer at once.
"""

from __future__ import annotations

import contextlib
import functools
import os
import re
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from tactile_cube import commands
from tactile_cube.api.job import typed_job
from tactile_cube.composition import CONFIG, help_text, refuse_unknown_keys, with_recipe
from tactile_cube.errors import InputError
from tactile_cube.run_folder import INTERRUPTED, USAGE_ERROR, configuration_in, console_kept_in
from tactile_cube.usage_error import usage_error

if TYPE_CHECKING:
    from omegaconf import DictConfig

PIPE_CLOSED = 141  # exit status of a program that writes to a closed pipe, as shells count it: 128 + SIGPIPE


def command_line(name: str, module: str = "") -> Callable[[], None]:
    """Return the command line of a function of `commands`, run where `module` is the program, `__main__`.

    Its configuration is conf/<name>.yaml.
    """

    @quiet_when_nobody_reads()
    def main() -> None:
        if {"--help", "-h"} & set(sys.argv[1:]):
            print(help_text(name))
            return
        sys.argv = with_recipe(name, sys.argv)
        _run(name)

    if module == "__main__":
        main()
    return main


@contextlib.contextmanager
def quiet_when_nobody_reads() -> Iterator[None]:
    """End without a traceback when the reader of a pipe leaves, as in `--help | head`."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more when it ends
        sys.exit(PIPE_CLOSED)


def _run(name: str) -> None:
    import hydra

    from tactile_cube.sweep import Jobs  # imports Hydra

    asked = os.environ.get("HYDRA_FULL_ERROR", "0")
    wants_traceback = asked != "0"
    os.environ["HYDRA_FULL_ERROR"] = "1"  # else Hydra prints errors in its own way and exits with status 1
    with _errors_in_one_line(wants_traceback):
        jobs = Jobs(functools.partial(_guarded, name, wants_traceback))

        def task(config: DictConfig) -> float | None:
            return jobs(config)

        task.__module__ = f"{__package__}.{name}"  # Hydra names the job and its log by it
        try:
            _refuse_plain_words(name, sys.argv[1:])
            hydra.main(version_base="1.3", config_path=str(CONFIG.resolve()), config_name=name)(task)()
        finally:
            os.environ["HYDRA_FULL_ERROR"] = asked
            swept = jobs.ended()
        if swept and name in commands.AFTER_SWEEP:
            commands.AFTER_SWEEP[name]([folder for folder, good in swept.items() if good])
        failed = [str(folder) for folder, good in swept.items() if not good]
        if failed:
            print(f"{len(failed)} of {len(swept)} runs failed: {', '.join(failed)}", file=sys.stderr)
            sys.exit(1)


def _refuse_plain_words(name: str, words: list[str]) -> None:
    """Refuse a value without its key, for which Hydra has words that nobody understands."""
    for before, word in pairwise(["", *words]):
        if not before.startswith("-") and re.fullmatch(r"[^-~=][^=]*", word):
            if name == "effects":
                from tactile_cube.api.effects import effects

                effects(word)
            first = re.search(r"^(?!defaults)\w+(?=:)", (CONFIG / f"{name}.yaml").read_text(encoding="utf-8"), re.M)
            meant = f"{word}=OPTION" if (CONFIG / word).is_dir() else f"{first and first[0]}={word}"
            raise InputError(f"{word}: settings are KEY=VALUE; did you mean {meant}?")


def _guarded(name: str, wants_traceback: bool, config: DictConfig, folder: Path) -> float | None:
    """Run one job and report its errors in one line: inside Hydra, which otherwise adds lines of its own."""
    log = folder / f"{name}.log"
    configuration = configuration_in(folder, config, log.name)
    with configuration, quiet_when_nobody_reads(), console_kept_in(log), _errors_in_one_line(wants_traceback):
        refuse_unknown_keys(name, config)
        answer: float | None = getattr(commands, name)(typed_job(config))
    return answer


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


def fail(message: str) -> NoReturn:
    """Print one line to stderr and exit with code 2."""
    print(f"error: {message}", file=sys.stderr)
    sys.exit(USAGE_ERROR)
