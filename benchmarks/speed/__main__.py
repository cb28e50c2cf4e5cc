"""Measure the speed of everything on this machine, beside other people's programs on the same work.

    python -m benchmarks.speed [environment update ...] [--rounds 7] [--no-peers] [--out outputs/speed]

Prints each section as it is done and writes benchmark.json and .md after each. Peers are naive PyBullet, MuJoCo
and Stable-Baselines3: pip install 'tactile-cube[benchmark]'.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import shlex
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.speed.report import Section

SECTIONS: dict[str, Callable[[int, bool], Section]] = {
    "environment": lambda rounds, peers: _function("environment")(rounds, peers),
    "accuracy": lambda rounds, peers: _function("accuracy")(),
    "update": lambda rounds, peers: _function("update")(rounds, peers),
    "end_to_end": lambda rounds, peers: _function("end_to_end")(min(rounds, 5), peers),
    "identification": lambda rounds, peers: _function("identification")(rounds, peers),
    "startup": lambda rounds, peers: _function("startup")(rounds),
}


def measure(name: str, rounds: int, peers: bool) -> Section:
    """Run one section.

    Args:
        name: of the section.
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
    """
    began = time.perf_counter()
    section = SECTIONS[name](rounds, peers)
    section.seconds = time.perf_counter() - began
    return section


def _function(name: str) -> Callable[..., Section]:
    """Sections are imported when they are run: one that was not asked for shall not cost a second."""
    found: Callable[..., Section] = getattr(importlib.import_module(f"benchmarks.speed.{name}"), name)
    return found


def asked() -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(
        "benchmarks.speed", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sections", nargs="*", choices=list(SECTIONS), metavar="section", help=", ".join(SECTIONS))
    parser.add_argument("--rounds", type=int, default=7, help="samples a figure; median and quartiles are shown")
    parser.add_argument("--no-peers", action="store_true", help="leave other people's programs out")
    parser.add_argument("--out", type=Path, default=Path("outputs/speed"), help="folder of the results")
    return parser.parse_args()


def main() -> None:
    """Run the sections one by one."""
    given = asked()
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core against one core; torch reads it when it is imported

    from benchmarks.speed.report import table
    from benchmarks.speed.timing import busy, machine
    from tactile_cube.agent.policy_file import current_commit

    command = shlex.join(["python", "-m", "benchmarks.speed", *sys.argv[1:]])
    facts = machine() | {"commit": current_commit(), "command": command}
    head = "\n".join(f"{key}: {value}" for key, value in facts.items())
    warning = (
        "other programs are running: compare ratios and processor times, not times on the clock\n" if busy() else ""
    )
    print(f"{head}\n{warning}", flush=True)
    done, page = [], f"# Benchmark\n\n{head.replace(chr(10), '  ' + chr(10))}\n\n{warning}"
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.sections or SECTIONS:
        print(f"measuring {name} ...", flush=True)
        done.append(measure(name, given.rounds, not given.no_peers))
        text = table(done[-1])
        print(f"{text}\n", flush=True)
        page += f"\n{text}\n"
        (given.out / "benchmark.md").write_text(page, encoding="utf-8")
        found = {"machine": facts, "sections": [section.plain() for section in done]}
        (given.out / "benchmark.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(f"results: {given.out / 'benchmark.json'}")


if __name__ == "__main__":
    main()
