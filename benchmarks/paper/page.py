"""The paper's results beside ours, as Markdown, from the results files of evaluate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.paper.rows import EVALUATE, HEAD, newest, paper_rows, summary_of
from tactile_cube.evaluation.results_file import read_results
from tactile_cube.evaluation.sweep_table import sweep_table
from tactile_cube.evaluation.training_curve import ANGLE, REGRASPING, STEPS, Curve, cpu_hours, regrasping_begins

Results = dict[str, Any]
TABLE_I = {
    "task=table, T_s 0.5 s": "0.3, 0.4, 0.3, 0.4",
    "task=float, T_s 0.5 s": "2.2, 1.7, 0.9, -",
    "task=full, T_s 0.5 s": "1.8, -, -, 2.3",
    "task=table, T_s 0.1 s": "0.4, 0.2, 0.2, 0.2",
    "task=float, T_s 0.1 s": "1.5, 5.8, -, 2.4",
    "task=full, T_s 0.1 s": "5.1, 1.7, 6.0, 3.9",
}
"""Million steps until regrasping of four runs; -: not within 6.5. Source: paper, Table I."""
TABLE_1 = "python -m tactile_cube.train -m +experiment=table1"
TITLE, DIFFERENCES = "# The paper's results beside ours", "## What is not as in the paper"
BREAKS = 0.8
"""Share of the nominal condition's mean angle below which another simulation is said to break the policy."""


def paper_page(
    results: Sequence[Results],
    curves: Sequence[Curve],
    table1: Mapping[str, Mapping[int, Curve]] | None = None,
    free_finger: Mapping[str, Any] | None = None,
    written: str = TITLE,
) -> str:
    """Return the page: the paper's rows, robustness, other simulations, Table I, training runs.

    Args:
        results: what `read_results` gave, the newest last; the newest that fits fills a row.
        curves: training runs.
        table1: the runs of `+experiment=table1`, as `read_sweep` gives them.
        free_finger: the comparison.json of a finger in free space, the paper's figure 4.
        written: the page as it is; its introduction and its section of differences are kept.
    """
    rows = paper_rows(results, free_finger)
    introduction, _, rest = written.partition(f"\n\n{HEAD}")
    differences = rest.partition(DIFFERENCES)[2].partition("\n\n## ")[0]
    parts = [introduction.strip(), rows, *([DIRTY] if "-dirty |" in rows else []), DIFFERENCES + differences]
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
    return ["## Table I: steps until regrasping", head, sweep_table(table1, TABLE_I)]


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
