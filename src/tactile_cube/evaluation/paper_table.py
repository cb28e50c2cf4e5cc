"""The paper's results beside ours, as Markdown, from the results files of evaluate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tactile_cube.evaluation.paper_differences import differences
from tactile_cube.evaluation.paper_rows import EVALUATE, newest, paper_rows, summary_of
from tactile_cube.evaluation.results_file import read_results
from tactile_cube.evaluation.sweep_table import PAPER_TABLE_1, sweep_table
from tactile_cube.evaluation.training_curve import ANGLE, REGRASPING, STEPS, Curve, cpu_hours, regrasping_begins

Results = dict[str, Any]
TABLE_1 = "python -m tactile_cube.train -m +experiment=table1"
BREAKS = 0.8
"""Share of the nominal condition's mean angle below which another simulation is said to break the policy."""


def paper_page(
    results: Sequence[Results],
    curves: Sequence[Curve],
    table1: Mapping[str, Mapping[int, Curve]] | None = None,
    free_finger: Mapping[str, Any] | None = None,
) -> str:
    """Return the page: the paper's rows, robustness, other simulations, Table I, training runs.

    Args:
        results: what `read_results` gave, the newest last; the newest that fits fills a row.
        curves: training runs.
        table1: the runs of `+experiment=table1`, as `read_sweep` gives them.
        free_finger: the comparison.json of a finger in free space, the paper's figure 4.
    """
    rows = paper_rows(results, free_finger)
    parts = ["# The paper's results beside ours", INTRODUCTION, rows, *([DIRTY] if "-dirty |" in rows else [])]
    parts += ["## What is not as in the paper", differences()]
    parts += _variant_section("Robustness", "perturbations", results)
    parts += [ROBUSTNESS_MAP] if any(one["protocol"] == "perturbations" for one in results) else []
    parts += [*_variant_section("Other simulations", "sim_to_sim", results), *_what_breaks(results)]
    parts += _table1_section(table1 or {})
    parts += _training_section(curves)
    return "\n\n".join(parts) + "\n"


def read_all(folder: Path) -> list[Results]:
    """Read every results file below a folder, the oldest first."""
    return sorted((read_results(file) for file in folder.rglob("*.json")), key=lambda one: str(one["created"]))


ROBUSTNESS_MAP = "![how far the cube is turned, and how often it is kept, along each axis](robustness.png)"
"""The robustness.png that `evaluate protocol=perturbations` writes, copied beside the page."""
INTRODUCTION = (
    "The policy of this page, `published`, was trained and is measured with fingertips whose spinning friction is "
    "0.1 m, as the paper states it. **PyBullet does not resolve that contact**: with 30 iterations of 2 ms its results "
    "stand up to 0.05 m, and at 0.1 m a twist changes by 10 % in finer steps "
    "([resolution.py](../../src/tactile_cube/simulation/resolution.py), [mechanics](mechanics.md)). Real fingertips "
    "bear some 3 mm; the policies for those stand on [another page](wide/README.md).\n\n"
    "Written by `python -m tactile_cube.results` from the results files under docs/results/runs. Paper: Sievers, Pitz, "
    "Bäuml, *Learning Purely Tactile In-Hand Manipulation with a Torque-Controlled Hand*, ICRA 2022. Here everything "
    "is simulation; the paper's robot numbers are a real hand's. An episode succeeds that keeps the cube to the end "
    "and turns it at least 80 % as far as the best of its ten or hundred."
)

DIRTY = (
    "A commit that ends in `-dirty` had changes in its working tree when the command ran. What they were was not "
    "recorded, so these rows may not come out the same; all others are of clean commits."
)


def _variant_section(title: str, protocol: str, results: Sequence[Results]) -> list[str]:
    """One line a variant, or the command where it was not run."""
    found = newest(results, lambda one: bool(one["protocol"] == protocol))
    if found is None:
        return [f"## {title}", f"Not run: `{EVALUATE} protocol={protocol}`"]
    head = f"`{found['command']}`, {found['cpu_hours']:.2f} CPU hours, policy {found['policy']['label']}, commit "
    head += f"{found.get('commit', 'not recorded')}."
    lines = ["| condition | mean angle [rad] | best | kept the cube | verdicts |", "|---|---|---|---|---|"]
    for variant in found["variants"]:
        summary = variant["summary"]
        verdicts = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in summary["verdicts"].items() if n)
        lines.append(
            f"| {variant['variant']['name']} | {summary['mean_angle']:.2f} +- {summary['std_angle']:.2f} "
            f"| {summary['best_angle']:.2f} | {summary['kept']}/{summary['episodes']} | {verdicts} |"
        )
    return [f"## {title}", head, "\n".join(lines)]


def _what_breaks(results: Sequence[Results]) -> list[str]:
    """The conditions that cost most, the worst first: what a lab should identify before anything else."""
    found = newest(results, lambda one: bool(one["protocol"] == "sim_to_sim"))
    if found is None:
        return []
    nominal = summary_of(found)["mean_angle"]
    angles = {one["variant"]["name"]: one["summary"]["mean_angle"] for one in found["variants"]}
    broken = sorted((name for name, angle in angles.items() if angle < BREAKS * nominal), key=angles.__getitem__)
    named = ", ".join(f"{name} ({angles[name]:.1f} rad)" for name in broken) or "none"
    return [f"Below {100 * BREAKS:.0f} % of the nominal angle, the worst first, and so the first to identify: {named}."]


def _table1_section(table1: Mapping[str, Mapping[int, Curve]]) -> list[str]:
    """The paper's Table I: how long until the fingers regrasp."""
    head = (
        f"`{TABLE_1}`, which goes on where it was when it is called again. Steps until the mean angle of the last 50 "
        "training episodes exceeds 3 rad; with `>`: not until then. A gait shows here how to regrasp and is imitated "
        "where it pays ([curriculum](curriculum/README.md)); the paper's runs find out by themselves. Machines, and "
        "runs beside these: [table1](table1/README.md)."
    )
    return ["## Table I: steps until regrasping", head, sweep_table(table1, tuple(PAPER_TABLE_1))]


def _training_section(curves: Sequence[Curve]) -> list[str]:
    """When regrasping began in each training run, and what it cost."""
    if not curves:
        return []
    lines = [
        "| run | million steps | until regrasping | CPU hours until then | best mean angle [rad] | CPU hours in all |",
        "|---|---|---|---|---|---|",
    ]
    for curve in curves:
        row = regrasping_begins(curve)
        begins = "-" if row is None else f"{curve.columns[STEPS][row] / 1e6:.2f}"
        cost = "-" if row is None else f"{cpu_hours(curve, row):.2f}"
        best = max(angle for angle in curve.columns[ANGLE] if not math.isnan(angle))
        lines.append(
            f"| {curve.label} | {curve.columns[STEPS][-1] / 1e6:.2f} | {begins} | {cost} | {best:.2f} "
            f"| {cpu_hours(curve, -1):.2f} |"
        )
    head = f"Until the mean angle of the last 50 training episodes exceeds {REGRASPING:g} rad."
    return ["## Training", head, "\n".join(lines)]
