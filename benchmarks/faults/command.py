"""Training command in a process of its own, and the processes that it leaves."""

import ctypes
import multiprocessing
import os
import sys
import time
import traceback
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path

import psutil

from benchmarks.faults.faulty_worlds import WISH

ENV = "env._target_=benchmarks.faults.faulty_worlds.faulty_environment"
SILENT = 45
"""Seconds after which silent workers count as stuck: on a machine at load 5, too."""
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["benchmarks.faults.preloaded"])


@dataclass
class Command:
    """`train +experiment=smoke` in a folder, forked from a process that has loaded what it needs.

    Attributes:
        folder: run folder.
        settings: further words.
        limit: longest time [s] it may take before it counts as hung.
        rows: that the undisturbed run writes into metrics.csv, without the header.
    """

    folder: Path
    settings: tuple[str, ...] = ()
    limit: float = 600.0
    rows: int = 0
    process: BaseProcess = field(init=False)

    def start(self) -> None:
        """Start it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        collector = ("collector.processes=2", f"collector.timeout={SILENT}", f"collector.start_timeout={SILENT}")
        words = ["+experiment=smoke", ENV, *collector, *self.settings, f"hydra.run.dir={self.folder}"]
        self.process = SERVER.Process(target=_train, args=(words, self.folder.with_suffix(".txt"), self.wish))
        self.process.start()

    @property
    def pid(self) -> int:
        """Process id of its main process."""
        assert self.process.pid is not None
        return self.process.pid

    @property
    def ended(self) -> bool:
        """Whether its main process has ended."""
        return self.process.exitcode is not None

    @property
    def wish(self) -> Path:
        """File that asks a world for a fault."""
        return self.folder.with_suffix(".wish")

    def wait(self) -> int | None:
        """Its exit status, negative after a signal; None when it hangs, and then it is killed."""
        self.process.join(self.limit)
        if not self.ended:
            for process in self.processes():
                process.kill()
        return self.process.exitcode if self.ended else None

    def workers(self) -> list[psutil.Process]:
        """Its simulation workers."""
        return [process for process in self.processes() if process.pid != self.pid]

    def processes(self) -> list[psutil.Process]:
        """Running processes of its session."""
        found = []
        for process in psutil.process_iter():
            try:
                if os.getsid(process.pid) == self.pid and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
            except (psutil.Error, ProcessLookupError):
                continue
        return found

    def orphans(self, seconds: float = 5.0) -> int:
        """Kill the processes that still run so long after the end; return their number."""
        deadline = time.monotonic() + seconds
        while (left := self.processes()) and time.monotonic() < deadline:
            time.sleep(0.2)
        for process in left:
            process.kill()
        return len(left)


def be_ready() -> None:
    """Wait for the process that commands are forked from."""
    first = SERVER.Process(target=int)
    first.start()
    first.join()


def _train(words: list[str], console: Path, wish: Path) -> None:
    from tactile_cube.cli import command_line

    os.setsid()
    with console.open("a") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    os.environ[WISH] = str(wish)
    sys.argv = ["train", *words]
    status = 0
    try:
        command_line("train")()
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(bool(ended.code))
    except BaseException:
        traceback.print_exc()
        status = 1
    # a child of multiprocessing leaves out what a program does at its end, where a training once hung
    ctypes.pythonapi.Py_Exit(ctypes.c_int(status))
