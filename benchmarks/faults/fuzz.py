"""Damaged files of every kind: is each read or refused in one line, soon, and nothing left half written?

    python -m benchmarks.faults.fuzz --inputs 10000 --seed 0 --out outputs/reliability

Readers are called as the commands call them, in one process.
"""

import argparse
import contextlib
import json
import os
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import FrameType

from benchmarks.faults.readers import READERS, Reader
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.errors import InputError

LIMIT = 20.0
"""CPU seconds after which a reader counts as hung; sound examples take less than a tenth of one."""
MEMORY = 4 * 2**30
"""Bytes that a reader may take beyond what the process has when it begins."""
HEAD = ("input", "damaged files", "read", "refused in one line", "tracebacks", "hung", "left something behind")


class Hung(BaseException):
    """A reader took too long; no `except Exception` on its way swallows it."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of reading a damaged file.

    Attributes:
        kind: "read", "refused", "traceback", "hung" or "left".
        detail: the message, or where it went wrong.
    """

    kind: str
    detail: str = ""


@contextlib.contextmanager
def limits() -> Iterator[None]:
    """Raise `Hung` after `LIMIT` seconds of CPU."""

    def too_long(number: int, frame: FrameType | None) -> None:
        raise Hung

    before = signal.signal(signal.SIGVTALRM, too_long)
    signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def strike(reader: Reader, example: Path, folder: Path, random: Random) -> Outcome:
    """Read a damaged copy of an example in a folder that there is not yet.

    Args:
        reader: the kind of file.
        example: folder with a sound one.
        folder: where the copy goes.
        random: what is damaged, and how.
    """
    shutil.copytree(example, folder)
    reader.damage(folder, random)
    before = _files(folder)
    with (
        open(os.devnull, "w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")
        outcome = _outcome(reader, folder)
    more = {name for name in _files(folder) - before if outcome.kind != "read" or not name.startswith("out/")}
    return Outcome("left", f"{sorted(more)}") if outcome.kind in ("read", "refused") and more else outcome


def _outcome(reader: Reader, folder: Path) -> Outcome:
    try:
        with limits():
            reader.read(folder)
    except InputError as error:
        message = str(error)
        return Outcome("traceback", f"several lines: {message!r}") if "\n" in message else Outcome("refused", message)
    except Hung:
        return Outcome("hung", f"{LIMIT:g} s of CPU")
    except BaseException as error:
        place = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in place if "tactile_cube" in frame.filename] or list(place)
        return Outcome("traceback", f"{type(error).__name__}: {error} ({Path(own[-1].filename).name}:{own[-1].lineno})")
    return Outcome("read")


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def campaign(inputs: int, seed: int, readers: Sequence[Reader] = READERS) -> dict[str, list[Outcome]]:
    """Outcomes by kind of file; each input follows from the seed, the kind and its number alone."""
    shares = sum(reader.share for reader in readers)
    outcomes: dict[str, list[Outcome]] = {}
    with tempfile.TemporaryDirectory() as place:
        for reader in readers:
            example, began = Path(place) / f"example of {reader.name}", time.process_time()
            example.mkdir()
            reader.make(example)
            reader.read(shutil.copytree(example, Path(place) / "sound"))
            shutil.rmtree(Path(place) / "sound")
            found = outcomes.setdefault(reader.name, [])
            for number in range(round(inputs * reader.share / shares)):
                folder = Path(place) / "damaged"
                found.append(strike(reader, example, folder, Random(f"{seed} {reader.name} {number}")))
                shutil.rmtree(folder)
                if found[-1].kind not in ("read", "refused"):
                    print(f"{reader.name} {number}: {found[-1].kind}: {found[-1].detail[:300]}", flush=True)
            kinds = dict(Counter(one.kind for one in found))
            print(f"{reader.name}: {kinds}, {time.process_time() - began:.0f} s of CPU", flush=True)
    return outcomes


def table(outcomes: dict[str, list[Outcome]]) -> str:
    """One line a kind of file, and their sum."""
    rows = [(name, [one.kind for one in found]) for name, found in outcomes.items()]
    rows.append(("all", [kind for _, kinds in rows for kind in kinds]))
    columns = ("read", "refused", "traceback", "hung", "left")
    lines = [HEAD, ("---",) * len(HEAD)]
    lines += [(name, str(len(kinds)), *(str(kinds.count(column)) for column in columns)) for name, kinds in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--inputs", type=int, default=10_000)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--out", type=Path)
    given = words.parse_args()
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    began = time.process_time()
    outcomes = campaign(given.inputs, given.seed)
    faults = [one for found in outcomes.values() for one in found if one.kind not in ("read", "refused")]
    page = (
        f"`python -m benchmarks.faults.fuzz --inputs {given.inputs} --seed {given.seed}`, commit {current_commit()}: "
        f"{time.process_time() - began:.0f} s of CPU\n\n{table(outcomes)}\n"
    )
    print(page)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        (given.out / "fuzz.md").write_text(page)
        (given.out / "fuzz.json").write_text(json.dumps({k: Counter(o.kind for o in v) for k, v in outcomes.items()}))
    raise SystemExit(1 if faults else 0)


if __name__ == "__main__":
    main()
