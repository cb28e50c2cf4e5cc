"""Measure cases of contact that have an answer from mechanics, in each engine at each accuracy setting.

    python -m benchmarks.mechanics [--engines bullet mujoco] [--accuracy fast faithful] [--cases creep ...] [--page F]

Writes outputs/mechanics.md. `fast` is 2 ms and 30 solver iterations, `faithful` 0.5 ms and 150.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from benchmarks.mechanics import CASES
from benchmarks.mechanics.case import ACCURACY, measure
from benchmarks.mechanics.page import mechanics_page
from benchmarks.mechanics.refinement import refine
from tactile_cube.agent.policy_file import current_commit
from tactile_cube.simulation import SimulationOptions

ENGINES = ("bullet", "mujoco")
SPINNING = (0.003, 0.01, 0.1)


def asked() -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(
        "benchmarks.mechanics", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=ENGINES)
    parser.add_argument("--accuracy", nargs="+", choices=list(ACCURACY), default=list(ACCURACY))
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    spinning = "spinning friction [m] at which steps and iterations are refined tenfold; no number: not at all"
    parser.add_argument("--spinning", nargs="*", type=float, default=SPINNING, help=spinning)
    parser.add_argument("--page", type=Path, default=Path("outputs/mechanics.md"), help="file to write")
    return parser.parse_args()


def main() -> None:
    """Run the cases and write the page."""
    given, commit = asked(), current_commit()
    options = {f"{engine} {name}": ACCURACY[name](engine) for engine in given.engines for name in given.accuracy}
    found = measure(options, {name: CASES[name] for name in given.cases}, say=print)
    finer = [row for one in given.engines for row in refine(SimulationOptions(one), given.spinning, say=print)]
    words = shlex.join(["python", "-m", "benchmarks.mechanics", *sys.argv[1:]])
    given.page.parent.mkdir(parents=True, exist_ok=True)
    command = f"{words}` at commit `{commit}" if commit else words
    given.page.write_text(mechanics_page(found, finer, command), encoding="utf-8")
    print(f"page: {given.page}")


if __name__ == "__main__":
    main()
