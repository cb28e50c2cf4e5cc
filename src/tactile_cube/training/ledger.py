"""Compute log of a run: CPU hours of simulation and of learning."""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from tactile_cube.whole_file import write_whole

LEDGER = "ledger.json"


@dataclass
class Costs:
    """CPU time of the workers and of the learner, and time on the clock, of one run over all its sessions [s]."""

    simulating: float = 0.0
    learning: float = 0.0
    wall: float = 0.0

    def __add__(self, other: "Costs") -> "Costs":
        """Return what both spent together."""
        return Costs(self.simulating + other.simulating, self.learning + other.learning, self.wall + other.wall)


class Ledger:
    """Compute log of a session, added to what earlier sessions of the run spent.

    Args:
        path: ledger.json of the run folder.
        simulating: CPU seconds simulated in this session so far.
        in_process: whether simulation runs in the learner's process, and its time is contained in the learner's.
    """

    def __init__(self, path: Path, simulating: Callable[[], float], in_process: bool):
        self.path, self.before = path, read_costs(path)
        self._simulating, self._in_process = simulating, in_process
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def costs(self) -> Costs:
        """Return what this run spent until now."""
        simulating = self._simulating()
        learning = time.process_time() - self._cpu - (simulating if self._in_process else 0.0)
        return self.before + Costs(simulating, learning, time.perf_counter() - self._wall)

    def write(self, steps: int) -> None:
        """Put the costs into the run folder."""
        write_costs(self.path, steps, self.costs())


def write_costs(path: Path, steps: int, costs: Costs) -> None:
    """Write a ledger, in hours as in the paper."""
    hours = {f"{name}_hours": round(value / 3600, 4) for name, value in asdict(costs).items()}
    text = json.dumps({"steps": steps, "seconds": asdict(costs), **hours}, indent=2) + "\n"
    write_whole(path, text.encode())


def read_costs(path: Path) -> Costs:
    """Return what was spent according to a ledger; nothing where there is none."""
    try:
        return Costs(**json.loads(path.read_text())["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return Costs()
