"""Faults of all kinds at random moments of `+experiment=smoke`: is anything lost, does anything hang or stay behind?

    python -m benchmarks.faults.campaign --faults 105 --seed 0 --out outputs/reliability

The run is as short as it can be with three barriers, two workers and learning from a replay; words at the end
change it.
After each fault the same command is given until it ends by itself; policy, checkpoint and metrics must then be those of
the undisturbed run, bit for bit.
"""

import argparse
import csv
import json
import os
import random
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import psutil
import torch

from benchmarks.faults.command import Command, be_ready
from tactile_cube.agent.policy_file import current_commit, load_actor
from tactile_cube.errors import InputError
from tactile_cube.training.checkpoint import BEFORE, FILE, Checkpoints, load_checkpoint


@dataclass(frozen=True)
class Phase:
    """Part of a run: how its beginning is detected, and how long it lasts [s]."""

    begun: Callable[[Command], bool]
    seconds: float


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: in the table.
        strike: does it to a running command; False when it had ended.
        undo: takes away what would keep the same command from going on.
        phase: in which it strikes; None: in the whole run.
    """

    name: str
    strike: Callable[[Command], bool]
    undo: Callable[[Command], None] = lambda command: None
    phase: Phase | None = None


def _main(*signals: int) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        if command.ended:
            return False
        try:
            for number in signals:
                os.kill(command.pid, number)
                time.sleep(0.1 if len(signals) > 1 else 0.0)
        except ProcessLookupError:  # one was enough
            return True
        return True

    return strike


def _worker(do: Callable[[psutil.Process], None]) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        deadline = time.monotonic() + 60.0
        while not command.ended and time.monotonic() < deadline:
            workers = command.workers()
            if workers:
                do(workers[0])
                return True
            time.sleep(0.1)
        return False

    return strike


def _little_memory(worker: psutil.Process) -> None:
    used = worker.memory_info().vms
    resource.prlimit(worker.pid, resource.RLIMIT_AS, (used, used))


def _wish(text: str) -> Callable[[Command], bool]:
    def strike(command: Command) -> bool:
        command.wish.write_text(text)
        return not command.ended

    return strike


def _no_wish(command: Command) -> None:
    command.wish.unlink(missing_ok=True)


def _full(command: Command) -> bool:
    if command.ended:
        return False
    resource.prlimit(command.pid, resource.RLIMIT_FSIZE, (20_000, 20_000))
    return True


def _blocked(command: Command) -> bool:
    (command.folder / "checkpoint_next.pt.partial").mkdir(exist_ok=True)
    return not command.ended


def _unblocked(command: Command) -> None:
    blocked = command.folder / "checkpoint_next.pt.partial"
    if blocked.is_dir():
        blocked.rmdir()


def _worker_there(command: Command) -> bool:
    return bool(command.workers())


def _all_logged(command: Command) -> bool:
    metrics = command.folder / "metrics.csv"
    return metrics.is_file() and metrics.read_text().count("\n") > command.rows


PHASES = {"while it starts": Phase(_worker_there, 1.0), "after the last iteration": Phase(_all_logged, 0.2)}
AT_ITS_ENDS = tuple(
    Kind(f"worker: {name} {words}", _worker(do), phase=phase)
    for name, do in (("SIGKILL", psutil.Process.kill), ("SIGSTOP", psutil.Process.suspend))
    for words, phase in PHASES.items()
)
"""What strikes workers that start, and those that are no longer needed once all rows of metrics.csv are there."""
KINDS = (
    Kind("main process: SIGKILL", _main(signal.SIGKILL)),
    Kind("worker: SIGKILL", _worker(psutil.Process.kill)),
    Kind("main process: SIGINT", _main(signal.SIGINT)),
    Kind("worker: SIGSTOP", _worker(psutil.Process.suspend)),
    Kind("main process: SIGTERM", _main(signal.SIGTERM)),
    Kind("worker: exception", _wish("raise"), _no_wish),
    Kind("main process: SIGINT twice", _main(signal.SIGINT, signal.SIGINT)),
    Kind("worker: NaN", _wish("nan"), _no_wish),
    Kind("disk full (size of files limited)", _full),
    Kind("worker: out of memory (limited)", _worker(_little_memory)),
    Kind("file cannot be written", _blocked, _unblocked),
)


SHORT = (
    "collector.worlds=4",
    "training.steps=240",
    "training.barrier_iterations=2",
    "training.learning_starts=80",
    "training.random_steps=80",
)
TIMES = ("simulating_hours", "learning_hours", "wall_hours")
"""Columns of metrics.csv that no two runs share."""


@dataclass
class Outcome:
    """Outcome of a fault.

    Attributes:
        kind: of fault.
        moment: when it struck, from the beginning of its phase [s].
        struck: False when the run had ended before.
        seconds: from the fault to the end of the command.
        status: its exit status; None: it hung.
        orphans: processes left behind.
        damaged: checkpoints that were not whole.
        again: times the command was given again.
        equal: whether it ended with the bits of the undisturbed run.
    """

    kind: str
    moment: float
    struck: bool
    seconds: float
    status: int | None
    orphans: int
    damaged: int
    again: int
    equal: bool


def undisturbed(folder: Path, settings: Sequence[str]) -> tuple[dict[str, Any], float]:
    """Return the results of the command without a fault, and how long it takes [s]."""
    be_ready()
    command = Command(folder, tuple(settings))
    began = time.monotonic()
    command.start()
    if command.wait() != 0:
        raise RuntimeError(f"the undisturbed run failed: {folder.with_suffix('.txt').read_text()[-500:]}")
    return results(folder), time.monotonic() - began


def strike(kind: Kind, folder: Path, moment: float, settings: Sequence[str], reference: dict[str, Any]) -> Outcome:
    """Inject one fault and return its outcome."""
    command = Command(folder, tuple(settings), rows=len(reference["rows"]))
    command.start()
    while kind.phase is not None and not command.ended and not kind.phase.begun(command):
        time.sleep(0.002)
    began = time.monotonic()
    while time.monotonic() - began < moment and not command.ended:
        time.sleep(0.002)
    struck = kind.strike(command)
    at = time.monotonic()
    status = command.wait()
    seconds, orphans = time.monotonic() - at, command.orphans()
    kind.undo(command)
    damaged, again = damaged_checkpoints(folder), 0
    while again == 0 or (status != 0 and again < 3):
        command.start()
        status_again, again = command.wait(), again + 1
        if status_again == 0:
            break
    equal = same(results(folder), reference)
    return Outcome(kind.name, round(moment, 1), struck, round(seconds, 1), status, orphans, damaged, again, equal)


def results(folder: Path) -> dict[str, Any]:
    """All numbers that a run leaves, but for its times."""
    state = Checkpoints(folder).load() or {}
    with (folder / "metrics.csv").open(newline="") as file:
        rows = [{key: value for key, value in row.items() if key not in TIMES} for row in csv.DictReader(file)]
    policy = load_actor(folder / "policy.safetensors")[0].state_dict()
    replay = state["learner"]["replay"]["transitions"]
    return {"agent": state["learner"]["agent"], "replay": replay, "rows": rows, "policy": policy}


def same(a: Any, b: Any) -> bool:
    """Return whether two trees of tensors and plain values are equal bit for bit."""
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def damaged_checkpoints(folder: Path) -> int:
    """Checkpoints that cannot be read."""
    damaged = 0
    for path in (folder / FILE, folder / BEFORE):
        try:
            if path.is_file():
                load_checkpoint(path)
        except InputError:
            damaged += 1
    return damaged


def table(outcomes: Sequence[Outcome], seconds: float) -> str:
    """One line a kind of fault."""
    head = ["fault", "struck", "hung", "orphans", "damaged checkpoints", "other bits", "longest to the end [s]"]
    lines = [head, ["---"] * len(head)]
    for name in dict.fromkeys(outcome.kind for outcome in outcomes):
        of_kind = [outcome for outcome in outcomes if outcome.kind == name]
        lines.append(
            [
                name,
                f"{sum(outcome.struck for outcome in of_kind)} of {len(of_kind)}",
                str(sum(outcome.status is None for outcome in of_kind)),
                str(sum(outcome.orphans for outcome in of_kind)),
                str(sum(outcome.damaged for outcome in of_kind)),
                str(sum(not outcome.equal for outcome in of_kind)),
                f"{max(outcome.seconds for outcome in of_kind):.0f}",
            ]
        )
    rows = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"{len(outcomes)} faults; the undisturbed run took {seconds:.0f} s; commit {current_commit()}\n\n{rows}\n"


def campaign(
    faults: int, seed: int, out: Path | None, settings: Sequence[str] = SHORT, kinds: Sequence[Kind] = KINDS
) -> list[Outcome]:
    """Inject all kinds of faults in turn, at moments spread over the run or its phase; write the table after each."""
    moments = random.Random(seed)
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as place:
        first, _ = undisturbed(Path(place) / "first", settings)
        reference, seconds = undisturbed(Path(place) / "undisturbed", settings)
        if not same(first, reference):
            raise RuntimeError("two undisturbed runs differ")
        for number in range(faults):
            kind = kinds[number % len(kinds)]
            folder, longest = Path(place) / f"fault{number}", kind.phase.seconds if kind.phase else seconds
            outcomes.append(strike(kind, folder, moments.uniform(0.0, longest), settings, reference))
            print(outcomes[-1], flush=True)
            shutil.rmtree(folder)
            if out is not None:
                out.mkdir(parents=True, exist_ok=True)
                (out / "faults.json").write_text(json.dumps([asdict(one) for one in outcomes], indent=1) + "\n")
                (out / "faults.md").write_text(table(outcomes, seconds))
    return outcomes


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--faults", type=int, default=100)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--out", type=Path)
    words.add_argument("--ends", action="store_true", help="only workers that start, and after the last iteration")
    words.add_argument("settings", nargs="*", help="further settings of the run, e.g. training.steps=1800")
    given = words.parse_args()
    kinds = AT_ITS_ENDS if given.ends else KINDS + AT_ITS_ENDS
    outcomes = campaign(given.faults, given.seed, given.out, [*SHORT, *given.settings], kinds)
    lost = [one for one in outcomes if one.status is None or one.orphans or one.damaged or not one.equal]
    print(f"{len(outcomes)} faults, {len(lost)} with a loss")
    raise SystemExit(1 if lost else 0)


if __name__ == "__main__":
    main()
