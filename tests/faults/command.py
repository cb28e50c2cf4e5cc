"""A training command in a process of its own, and what is left of it."""

import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from tests.faults.faulty_worlds import WISH

MARK = "TACTILE_CUBE_TEST_RUN"
ENV = "env._target_=tests.faults.faulty_worlds.faulty_environment"
ROOT = Path(__file__).parents[2]


@dataclass
class Command:
    """`train +experiment=smoke` in a folder.

    Attributes:
        folder: run folder.
        settings: further words.
        limit: longest time [s] it may take before it counts as hung.
    """

    folder: Path
    settings: tuple[str, ...] = ()
    limit: float = 600.0
    process: subprocess.Popen[str] = field(init=False)

    def start(self) -> None:
        """Start it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        collector = ("collector.processes=2", "collector.timeout=60", "collector.start_timeout=60")
        words = ["+experiment=smoke", ENV, *collector, *self.settings]
        path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
        marks = {MARK: str(self.folder), WISH: str(self.wish), "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}
        with (self.folder.parent / f"{self.folder.name}.txt").open("a") as console:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "tactile_cube.train", *words, f"hydra.run.dir={self.folder}"],
                env=os.environ | marks,
                stdout=console,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                text=True,
            )

    @property
    def wish(self) -> Path:
        """File that asks a world for a fault."""
        return self.folder.parent / f"{self.folder.name}.wish"

    def wait(self) -> int | None:
        """Its exit status; None when it hangs, and then it is killed."""
        try:
            return self.process.wait(self.limit)
        except subprocess.TimeoutExpired:
            for process in self.processes():
                process.kill()
            return None

    def workers(self) -> list[psutil.Process]:
        """Its simulation workers."""
        return [process for process in self.processes() if process.pid != self.process.pid]

    def processes(self) -> list[psutil.Process]:
        """All that runs of it."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.environ().get(MARK) == str(self.folder) and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def orphans(self, seconds: float = 5.0) -> int:
        """Processes still there so long after the end; they are killed."""
        deadline = time.monotonic() + seconds
        while (left := self.processes()) and time.monotonic() < deadline:
            time.sleep(0.2)
        for process in left:
            process.kill()
        return len(left)
