"""The paper's results beside ours, as Markdown, from the results files of evaluate."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_cube.errors import InputError
from tactile_cube.evaluation.model_card import read_card
from tactile_cube.evaluation.policy_path import SHIPPED
from tactile_cube.evaluation.results_file import read_results
from tactile_cube.evaluation.sweep_table import PAPER_TABLE_1, sweep_table
from tactile_cube.evaluation.training_curve import ANGLE, REGRASPING, STEPS, Curve, cpu_hours, regrasping_begins

Results = dict[str, Any]
EVALUATE = "python -m tactile_cube.evaluate"
TABLE_1 = "python -m tactile_cube.train -m +experiment=table1"
TRAIN = "python -m tactile_cube.train +experiment=curriculum`, then `+experiment=finetune"
SCRIPTED = "scripted"
FINGER = "outputs/finger"
FREE_FINGER = f"python -m tactile_cube.record out={FINGER}` and `python -m tactile_cube.compare recording={FINGER}"
BREAKS = 0.8
"""Share of the nominal condition's mean angle below which another simulation is said to break the policy."""


@dataclass(frozen=True)
class Row:
    """One result of the paper.

    Attributes:
        what: the experiment.
        paper: the paper's number. Source: paper, section IV and the authors' website.
        protocol: of conf/protocol that repeats it.
        ours: our number from the results.
        policy: "scripted" for the hand-crafted trajectory; "" for any trained policy.
        made_by: the command, where it is not the evaluation.
    """

    what: str
    paper: str
    protocol: str
    ours: Callable[[Results], str]
    policy: str = ""
    made_by: str = ""

    @property
    def command(self) -> str:
        """The command that fills the row."""
        if self.made_by:
            return self.made_by
        policy = f"policy={self.policy} " if self.policy else ""
        return f"{EVALUATE} {policy}protocol={self.protocol}"

    def fits(self, results: Results) -> bool:
        """Whether results fill this row: the cube at full weight in the air, as in the paper."""
        task = results["task"]
        if task["table"] or task["gravity_scale"] < 1.0:
            return False
        label = results["policy"]["label"]
        fits_policy = label == SCRIPTED if self.policy else label not in ("hold", "random", SCRIPTED)
        return bool(results["protocol"] == self.protocol) and fits_policy


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
    parts = ["# The paper's results beside ours", INTRODUCTION, _paper_rows(results, free_finger)]
    parts += [*_variant_section("Robustness", "perturbations", results), ROBUSTNESS_MAP]
    parts += [*_variant_section("Other simulations", "sim_to_sim", results), *_what_breaks(results)]
    parts += _table1_section(table1 or {})
    parts += _training_section(curves)
    return "\n\n".join(parts) + "\n"


def read_all(folder: Path) -> list[Results]:
    """Read every results file below a folder, the oldest first."""
    return sorted((read_results(file) for file in folder.rglob("*.json")), key=lambda one: str(one["created"]))


def _newest(results: Sequence[Results], fits: Callable[[Results], bool]) -> Results | None:
    return next((one for one in reversed(results) if fits(one)), None)


def read_comparison(path: Path) -> dict[str, Any]:
    """Read the comparison.json of `compare`.

    Raises:
        InputError: it cannot be read, or has no band of randomised simulations.
    """
    try:
        comparison = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not the comparison.json of compare: {error}") from error
    if not isinstance(comparison, dict) or not isinstance(comparison.get("band"), dict):
        raise InputError(f"{path}: no band of randomised simulations; run compare with band.simulations=50")
    return comparison


def _paper_rows(results: Sequence[Results], free_finger: Mapping[str, Any] | None) -> str:
    lines = ["| experiment | paper | here | policy, seed | CPU hours | command |", "|---|---|---|---|---|---|"]
    for row in ROWS:
        found = _newest(results, row.fits)
        if found is None:
            lines.append(f"| {row.what} | {row.paper} | not run | | | `{row.command}` |")
            continue
        cost = "" if row.made_by else f"{found['cpu_hours']:.2f}"
        made = f"{found['policy']['label']}, {found['seed']} | {cost} | `{row.made_by or found['command']}`"
        lines.append(f"| {row.what} | {row.paper} | {row.ours(found)} | {made} |")
    lines.append(_free_finger_row(free_finger))
    return "\n".join(lines)


def _free_finger_row(comparison: Mapping[str, Any] | None) -> str:
    """The paper's figure 4: what is measured lies among randomised simulations."""
    what = "one finger in free space, open loop (figure 4)"
    paper = "15 recordings of 3 initialisations lie among 50 randomised simulations"
    if comparison is None:
        return f"| {what} | {paper} | not run | | | `{FREE_FINGER}` |"
    band, trials = comparison["band"], comparison["trials"]
    starts = len({trial["initialisation"] for trial in trials})
    ours = (
        f"{100 * band['inside']:.0f} % of the samples of {len(trials)} recordings of {starts} initialisations of a "
        f"simulated finger lie among {band['simulations']}"
    )
    return f"| {what} | {paper} | {ours} | | {comparison['seconds'] / 3600:.2f} | `{FREE_FINGER}` |"


def _summary(results: Results, variant: int = 0) -> dict[str, Any]:
    summary: dict[str, Any] = results["variants"][variant]["summary"]
    return summary


def _successes(results: Results) -> str:
    summary = _summary(results)
    low, high = (round(100 * summary[key]) for key in ("success_low", "success_high"))
    return f"{summary['successes']}/{summary['episodes']} (95 %: {low} to {high} %)"


def _best(results: Results) -> str:
    return f"{_summary(results)['best_angle']:.1f} rad"


def _longest(results: Results) -> str:
    """The episode that turned farthest: angle, turns, time, ending."""
    best = max(results["variants"][0]["episodes"], key=lambda episode: episode["final_angle"])
    turns = best["final_angle"] / (2 * math.pi)
    minutes = best["duration"] / 60
    return f"{best['final_angle']:.0f} rad, {turns:.1f} turns, {minutes:.1f} min, {best['ending'].replace('_', ' ')}"


def _replayed(results: Results) -> str:
    original, replay = _summary(results), _summary(results, -1)
    return (
        f"{replay['mean_angle']:.1f} +- {replay['std_angle']:.1f} rad of {original['best_angle']:.1f}; "
        f"{replay['kept']}/{replay['episodes']} kept the cube"
    )


def _with_endings(results: Results) -> str:
    summary = _summary(results)
    kept = f"{summary['kept']}/{summary['episodes']} kept"
    return f"best {summary['best_angle']:.1f}, mean {summary['mean_angle']:.1f} rad; {kept}"


def _verdicts(name: str) -> Callable[[Results], str]:
    """How many episodes ended with a verdict."""
    return lambda results: f"{_summary(results)['verdicts'][name]}/{_summary(results)['episodes']}"


def _along(axis: str) -> Callable[[Results], str]:
    """Where the cube was kept along one axis of the robustness map, and how far it was turned there."""

    def ours(results: Results) -> str:
        along = [one for one in results["variants"] if one["variant"].get("axis") == axis]
        points = [(f"{one['variant']['value']:g}", one["summary"]) for one in along]
        shown = [f"{at}: {of['kept']}/{of['episodes']} kept, {of['mean_angle']:.1f} rad" for at, of in points]
        return f"{axis} {'; '.join(shown)}; nominal {_summary(results)['mean_angle']:.1f} rad"

    return ours


def _training_cost(results: Results) -> str:
    """What the policy's card says, where it comes with the package."""
    card = SHIPPED / f"{results['policy']['label']}.md"
    return read_card(card)["CPU hours"] if card.is_file() else "see the ledger of its run"


ROWS = (
    Row("CPU hours of training", "600", "paper", _training_cost, made_by=TRAIN),
    Row("10 runs of 40 s, at least 80 % of the best run", "robot 8/10, simulation 9/10", "paper", _successes),
    Row("best of these runs", "15 rad", "paper", _best),
    Row("the same, 100 runs", "-", "many", _successes),
    Row("endurance, at most 16 min", "289 rad, 46 turns, stopped by hand", "endurance", _longest),
    Row("open-loop replay of a successful run", "fails after pi/2", "replay", _replayed),
    Row("hand-crafted trajectory", "11 rad, then drops", "paper", _with_endings, SCRIPTED),
    Row("failure (a): stuck with twisted fingers", "until q1 was penalised", "many", _verdicts("stuck_twisted")),
    Row("failure (c): turns on and drops it", "seen", "many", _verdicts("spun_and_dropped")),
    Row("a finger is pulled", "withstands", "perturbations", _along("ring finger pulled [N]")),
    Row("other orientations", "withstands", "perturbations", _along("hand tilted [deg]")),
    Row("other cubes", "withstands, over 2 cm", "perturbations", _along("cube edge [mm]")),
    Row("cuboids", "after fine-tuning", "perturbations", _along("cuboid: longer in x [mm]")),
)
"""Source: paper, section IV, and the authors' website."""

ROBUSTNESS_MAP = "![how far the cube is turned, and how often it is kept, along each axis](robustness.png)"
"""The robustness.png that `evaluate protocol=perturbations` writes, copied beside the page."""
INTRODUCTION = (
    "Written by `python -m tactile_cube.results` from the results files under docs/results/runs. Paper: Sievers, Pitz, "
    "Bäuml, *Learning Purely Tactile In-Hand Manipulation with a Torque-Controlled Hand*, ICRA 2022. Here everything "
    "is simulation; the paper's robot numbers are a real hand's."
)


def _variant_section(title: str, protocol: str, results: Sequence[Results]) -> list[str]:
    """One line a variant, or the command where it was not run."""
    found = _newest(results, lambda one: bool(one["protocol"] == protocol))
    if found is None:
        return [f"## {title}", f"Not run: `{EVALUATE} protocol={protocol}`"]
    head = f"`{found['command']}`, {found['cpu_hours']:.2f} CPU hours, policy {found['policy']['label']}."
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
    found = _newest(results, lambda one: bool(one["protocol"] == "sim_to_sim"))
    if found is None:
        return []
    nominal = _summary(found)["mean_angle"]
    angles = {one["variant"]["name"]: one["summary"]["mean_angle"] for one in found["variants"]}
    broken = sorted((name for name, angle in angles.items() if angle < BREAKS * nominal), key=angles.__getitem__)
    named = ", ".join(f"{name} ({angles[name]:.1f} rad)" for name in broken) or "none"
    return [f"Below {100 * BREAKS:.0f} % of the nominal angle, the worst first, and so the first to identify: {named}."]


def _table1_section(table1: Mapping[str, Mapping[int, Curve]]) -> list[str]:
    """The paper's Table I: how long until the fingers regrasp."""
    head = (
        f"`{TABLE_1}`, which goes on where it was when it is called again. Steps until the mean angle of the last 50 "
        "training episodes exceeds 3 rad; with `>`: not until then. A gait shows here how to regrasp and is imitated "
        "where it pays (docs/results/curriculum); the paper's runs find out by themselves."
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
