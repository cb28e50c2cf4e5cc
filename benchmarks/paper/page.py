"""The paper's results beside ours, as Markdown, from the results files of evaluate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.paper import budget
from benchmarks.paper.rows import EVALUATE, HEAD, newest, paper_rows, read_results, typed

Results = dict[str, Any]
TITLE, DIFFERENCES = "# The paper's results beside ours", "## Statement by statement"
AS_GOOD = 0.75
"""Share of the nominal counts and mean angle from which on a condition is only counted."""


def paper_page(
    results: Sequence[Results],
    free_finger: Mapping[str, Any] | None = None,
    written: str = TITLE,
) -> str:
    """Return the page: the paper's rows, robustness, other simulations.

    Args:
        results: what `read_results` gave, the newest last; the newest that fits fills a row.
        free_finger: the comparison.json of a finger in free space, the paper's figure 4.
        written: the page as it is; its introduction and its section of differences are kept.
    """
    rows = paper_rows(results, free_finger)
    introduction, _, rest = written.partition(f"\n\n{HEAD}")
    differences = rest.partition(DIFFERENCES)[2].partition("\n\n## ")[0]
    parts = [introduction.strip(), rows, *([DIRTY] if "-dirty |" in rows else []), DIFFERENCES + differences]
    parts += budget.section()
    parts += _variant_section("Robustness", "perturbations", results)
    parts += [ROBUSTNESS_MAP] if any(one["protocol"] == "perturbations" for one in results) else []
    parts += _variant_section("Other simulations", "sim_to_sim", results)
    return "\n\n".join(parts) + "\n"


def read_all(folder: Path) -> list[Results]:
    """Read every results file below a folder, the oldest first."""
    return sorted((read_results(file) for file in folder.rglob("*.json")), key=lambda one: str(one["created"]))


ROBUSTNESS_MAP = (
    "![how far the cube is turned, and how often it is kept, along each axis](images/published_robustness.png)"
)
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
    episodes, commit = found["variants"][0]["summary"]["episodes"], found.get("commit", "not recorded")
    head = f"`{typed(found['command'])}`, {found['cpu_hours']:.2f} CPU hours, commit {commit}, {episodes} runs each."
    lines = ["| condition | kept, regrasping | mean angle [rad] |", "|---|---|---|"]
    as_good, nominal = 0, _counts(found["variants"][0])
    for number, variant in enumerate(found["variants"]):
        kept, regrasping, angle = counts = _counts(variant)
        if number and all(one >= AS_GOOD * usual for one, usual in zip(counts, nominal, strict=True)):
            as_good += 1
        else:
            lines.append(f"| {variant['variant']['name']} | {kept}, {regrasping} | {angle:.1f} |")
    rest = f"{as_good} more conditions keep at least {100 * AS_GOOD:.0f} % of both counts and of the angle."
    return [f"## {title}", head, "\n".join(lines), rest]


def _counts(variant: Mapping[str, Any]) -> tuple[int, int, float]:
    """Episodes that kept the cube, episodes that regrasped, and the mean angle [rad] of a condition."""
    summary = variant["summary"]
    return summary["kept"], summary["verdicts"].get("regrasping", 0), summary["mean_angle"]
