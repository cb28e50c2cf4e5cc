"""`+experiment=smoke` in workers of Ray: has it the bits of multi_sync, also when a worker, a node or main is lost?

And is a batch done to the last one when a node is lost?

    python -m benchmarks.faults.ray_faults --out outputs/reliability

The run is a fifth of smoke's. Each fault strikes once it is an iteration past its second barrier. After it the same
command is given until it ends by itself. Needs pip install '.[ray]'.
"""

import argparse
import hashlib
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
import torch

from benchmarks.faults.campaign import SHORT, results
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.api.batch import each

SMOKE = ["+experiment=smoke", "collector.processes=2", "collector.timeout=60", *SHORT, "training.steps=600"]
STRIKE_AT = 5
"""Rows of metrics.csv, one an iteration, at which a fault strikes; a barrier comes every two, the end after 15."""
BATCH = 8
LIMIT = 900.0
"""Seconds after which a run counts as hung."""
MARK = "TACTILE_CUBE_TRIAL"
"""Environment variable by which processes of a run are known, whoever their parent is."""

Fault = Callable[["Trial"], None]


@dataclass
class Trial:
    """A run of smoke as a user types it.

    Attributes:
        folder: run folder.
        words: settings beside those of `SMOKE`.
    """

    folder: Path
    words: list[str]
    mark: str = field(default_factory=lambda: secrets.token_hex(8))
    process: "subprocess.Popen[bytes]" = field(init=False)

    def start(self) -> None:
        """Start it."""
        command = [sys.executable, "-m", "tactile_cube.train", *SMOKE, *self.words, f"hydra.run.dir={self.folder}"]
        with self.folder.with_suffix(".txt").open("ab") as console:
            self.process = subprocess.Popen(
                command, stdout=console, stderr=console, env=os.environ | {MARK: self.mark}, start_new_session=True
            )

    def ran(self) -> int:
        """Iterations done, as far as they are logged."""
        metrics = self.folder / "metrics.csv"
        return metrics.read_text().count("\n") - 1 if metrics.exists() else 0

    def wait_for(self, rows: int) -> None:
        """Wait until so many iterations are done."""
        until = time.monotonic() + LIMIT
        while self.ran() < rows and self.process.poll() is None and time.monotonic() < until:
            time.sleep(0.02)
        if self.process.poll() is not None:
            raise RuntimeError(f"ended before the fault: {self.console()}")

    def console(self) -> str:
        """What it printed."""
        return self.folder.with_suffix(".txt").read_text()

    def processes(self) -> list[psutil.Process]:
        """All that runs of it."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.environ().get(MARK) == self.mark and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def worker(self) -> psutil.Process:
        """One of its workers on this node."""
        return next(process for process in self.processes() if "RemoteCollector" in process.name())

    def orphans(self, seconds: float = 20.0) -> int:
        """Processes still there so long after the end; they are killed."""
        until = time.monotonic() + seconds
        while (left := self.processes()) and time.monotonic() < until:
            time.sleep(0.2)
        for process in left:
            process.kill()
        return len(left)


def digest(tree: Any) -> str:
    """Of a tree of tensors and plain values."""
    sha = hashlib.sha256()

    def add(part: Any) -> None:
        if isinstance(part, torch.Tensor):
            sha.update(str(part.dtype).encode() + part.contiguous().view(-1).view(torch.uint8).numpy().tobytes())
        elif isinstance(part, dict):
            for key in sorted(part, key=str):
                sha.update(str(key).encode())
                add(part[key])
        elif isinstance(part, list | tuple):
            for one in part:
                add(one)
        else:
            sha.update(repr(part).encode())

    add(tree)
    return sha.hexdigest()[:16]


def run(name: str, folder: Path, words: list[str], fault: Fault | None = None) -> list[str]:
    """One row of the table."""
    trial = Trial(folder, words)
    trial.start()
    if fault is not None:
        trial.wait_for(STRIKE_AT)
        fault(trial)
    began = time.monotonic()
    again, orphans, status = 0, 0, -1
    while status != 0 and again < 3:
        try:
            status = trial.process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            trial.process.kill()
            return [name, load(), "hung", "", "", str(orphans + trial.orphans()), ""]
        orphans += trial.orphans()
        if status != 0:
            again += 1
            trial.start()
    replaced = trial.console().count("going back to the last barrier")
    seconds = f"{time.monotonic() - began:.0f}"
    return [name, load(), seconds, str(replaced), str(again), str(orphans), digest(results(folder))]


def load() -> str:
    """Of the machine, in the last five minutes."""
    return f"{os.getloadavg()[1]:.0f}"


@contextmanager
def two_nodes(cores: int) -> Iterator[tuple[str, Callable[[], None]]]:
    """A cluster of two nodes on this machine: its address, and what takes the second one away."""
    from ray.cluster_utils import Cluster

    small = {"num_cpus": cores, "object_store_memory": 128 * 2**20}
    cluster = Cluster(initialize_head=True, head_node_args=small | {"include_dashboard": False})
    try:
        second = cluster.add_node(**small)
        yield cluster.address, lambda: cluster.remove_node(second, allow_graceful=False)
    finally:
        cluster.shutdown()


def without_a_node(place: Path) -> list[str]:
    """A run in a cluster of two nodes, one of which is taken away meanwhile."""
    with two_nodes(cores=2) as (address, remove):
        words = ["collector=ray", f"collector.address={address}"]
        return run("ray, two nodes, one removed", place / "removed", words, lambda trial: remove())


def batch_without_a_node() -> list[int]:
    """What comes of a batch on two nodes, one of which is taken away after the second answer."""
    done: list[int] = []
    with two_nodes(cores=1) as (address, remove):
        for number, square in each(slow_square, range(BATCH), address=address):
            done += [number] if square == number**2 else []
            if len(done) == BATCH // 4:
                remove()
    return sorted(done)


def slow_square(number: int) -> int:
    """Takes as long as a short diagnosis."""
    time.sleep(3.0)
    return number**2


def table(rows: list[list[str]], batch: str = "") -> str:
    """What the page shows."""
    head = ["collector, fault", "load of two cores", "seconds from the fault (or start) to the end", "times replaced"]
    head += ["given again", "orphans", "digest of networks, optimisers, replay, metrics and policy"]
    lines = "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rows])
    return f"`python -m benchmarks.faults.ray_faults`, commit {current_commit()}\n\n{lines}\n{batch}"


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--out", type=Path)
    given = words.parse_args()
    if "RAY_AUTH_TOKEN" not in os.environ:  # for the cluster of two nodes; Ray, which torchrl imports, reads it at once
        private = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "RAY_AUTH_MODE": "token"}
        environment = os.environ | private | {"RAY_AUTH_TOKEN": secrets.token_hex(32)}
        os.execve(sys.executable, [sys.executable, "-m", "benchmarks.faults.ray_faults", *sys.argv[1:]], environment)
    place = Path(tempfile.mkdtemp())
    local = ["collector=ray"]
    trials: list[Callable[[], list[str]]] = [
        lambda: run("multi_sync", place / "multi_sync", ["collector=multi_sync"]),
        lambda: run("ray", place / "ray", local),
        lambda: run("ray, a worker killed", place / "killed", local, lambda trial: trial.worker().kill()),
        lambda: without_a_node(place),
        lambda: run("ray, main process killed", place / "main", local, lambda trial: trial.process.kill()),
        lambda: run("ray, a worker stopped", place / "stopped", local, lambda trial: trial.worker().suspend()),
    ]
    rows: list[list[str]] = []
    for trial in trials:
        rows.append(trial())
        print(rows[-1], flush=True)
        if given.out is not None:
            (given.out / "ray.md").write_text(table(rows))
    batch = batch_without_a_node()
    said = f"\nA batch of {BATCH} on two nodes, one removed after the second answer: {len(batch)} answers, each once.\n"
    print(said)
    if given.out is not None:
        (given.out / "ray.md").write_text(table(rows, said))
    same = {row[-1] for row in rows} == {rows[0][-1]} and batch == list(range(BATCH))
    shutil.rmtree(place)
    raise SystemExit(0 if same and all(row[-2] == "0" for row in rows) else 1)


if __name__ == "__main__":
    main()
