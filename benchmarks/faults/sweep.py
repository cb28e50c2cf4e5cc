"""A sweep whose main process is killed in its second run: does the same command end it, with the same bits?

    python -m benchmarks.faults.sweep --out outputs/reliability

Runs of `+experiment=smoke` as short as the campaign's, four seeds one after the other. Writes sweep.md.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.faults.campaign import SHORT, results, same
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.training.run import FILE

SEEDS = 4
STRUCK = 1
"""The run that is struck, once it has logged its first iterations."""
LONGEST = 600.0
"""Seconds after which a sweep counts as hung."""


def started(folder: Path) -> "subprocess.Popen[bytes]":
    """The sweep as a user types it."""
    seeds = "seed=" + ",".join(map(str, range(SEEDS)))
    words = ["-m", "tactile_cube.train", "-m", "+experiment=smoke", *SHORT, seeds, f"hydra.sweep.dir={folder}"]
    with folder.with_suffix(".txt").open("ab") as console:
        return subprocess.Popen([sys.executable, *words], stdout=console, stderr=console, start_new_session=True)


def run_of(folder: Path, seed: int) -> Path | None:
    """A run's folder, once it is there."""
    return next(folder.glob(f"smoke/*seed{seed}"), None)


def kill_in(folder: Path, seed: int, process: "subprocess.Popen[bytes]") -> None:
    """SIGKILL of everything when that run has logged an iteration."""
    until = time.monotonic() + LONGEST
    while time.monotonic() < until and process.poll() is None:
        run = run_of(folder, seed)
        if run and (run / "metrics.csv").is_file() and (run / "metrics.csv").read_text().count("\n") > 1:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return
        time.sleep(0.02)
    raise RuntimeError(f"the sweep ended before it could be struck: {folder.with_suffix('.txt').read_text()}")


def page(place: Path) -> tuple[str, bool]:
    """The table, and whether nothing was lost."""
    whole, struck = place / "whole", place / "struck"
    if started(whole).wait(LONGEST) != 0:
        raise RuntimeError(whole.with_suffix(".txt").read_text())
    process = started(struck)
    kill_in(struck, STRUCK, process)
    there = {seed: run_of(struck, seed) for seed in range(SEEDS)}
    finished = {seed: (run / FILE).stat().st_mtime_ns for seed, run in there.items() if run and (run / FILE).is_file()}
    status = started(struck).wait(LONGEST)
    rows, sound = [], status == 0
    for seed in range(SEEDS):
        ours, other = run_of(struck, seed), run_of(whole, seed)
        equal = ours is not None and other is not None and same(results(ours), results(other))
        left = seed in finished and ours is not None and (ours / FILE).stat().st_mtime_ns == finished[seed]
        before = "finished" if seed in finished else "struck" if there[seed] else "not begun"
        rows.append(
            f"| {seed} | {before} | {'left in peace' if left else 'run'} | {'the same' if equal else 'other'} |"
        )
        sound = sound and equal and left == (seed in finished)
    head = f"`python -m benchmarks.faults.sweep`, commit {current_commit()}; status of the second call {status}"
    columns = "| seed | when the sweep was killed | by the same command | bits, beside an undisturbed sweep |"
    return "\n".join([head, "", columns, "| --- | --- | --- | --- |", *rows, ""]), sound


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--out", type=Path)
    given = words.parse_args()
    with tempfile.TemporaryDirectory() as place:
        text, sound = page(Path(place))
    print(text)
    if given.out is not None:
        (given.out / "sweep.md").write_text(text)
    raise SystemExit(0 if sound else 1)


if __name__ == "__main__":
    main()
