"""A shipped policy's card: what it is, how it was made, what it does, and what it cannot do."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.paper.ancestry import NONE, Ancestor, ancestry_table, total
from tactile_cube.agent.policy_file import PolicyInfo
from tactile_cube.evaluation.verdict import SUCCESS, SUCCESS_RATE

Results = dict[str, Any]


def model_card(name: str, info: PolicyInfo, runs: Sequence[Ancestor], results: Sequence[Results], limits: str) -> str:
    """Return the card as Markdown.

    Args:
        name: of the policy.
        info: what its file says.
        runs: that it comes from, the first one first, its own the last.
        results: results files of evaluations of this policy.
        limits: what it cannot do, in the author's words.
    """
    task = info.config.get("task", {})
    filter_time, gravity = task.get("filter_time", "?"), task.get("gravity_scale", "?")
    trained = [run for run in runs if run.settings]
    made = {
        "task": f"{task.get('name', '?')}, T_s {filter_time} s, gravity {gravity}",
        "environment steps": ", then ".join(f"{run.steps or 0:,} ({run.name})".replace(",", " ") for run in trained),
        **({"weights": f"mean of those after {', '.join(map(str, info.averaged))} steps"} if info.averaged else {}),
        "seed": info.seed,
        "commit": info.commit,
        "teacher": "; ".join(f"{run.teacher} ({run.name})" for run in trained if run.teacher != NONE) or NONE,
        "CPU hours": total(runs),
        "network": f"{info.observation_size} -> {' -> '.join(map(str, info.hidden))} -> {info.action_size}",
    }
    lines = [
        f"# Policy `{name}`",
        "",
        "Turns an 8 cm cube about the vertical with the DLR-Hand II, by touch alone.",
        "",
    ]
    lines += ["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in made.items())]
    lines += ["", "## Where it comes from", "", *ancestry_table(runs)]
    lines += ["", "## Measured", "", *(_measured(results) or ["Not evaluated yet."])]
    lines += ["", "## Limits", "", limits or "Trained and measured in simulation only; never run on a hand.", ""]
    lines += ["## Configuration", "", "```json", json.dumps(info.config, indent=1), "```", ""]
    return "\n".join(lines)


def read_card(path: Path) -> dict[str, str]:
    """Read the table of facts at the head of a card that `model_card` wrote."""
    cells = [
        line.strip("| ").split(" | ") for line in path.read_text(encoding="utf-8").splitlines() if line[:2] == "| "
    ]
    return {row[0]: row[1] for row in cells if len(row) == 2}


def _measured(results: Sequence[Results]) -> list[str]:
    """One line an evaluation."""
    lines = [f"Successful: {SUCCESS}.", ""] if results else []
    for result in results:
        summary = result["variants"][0]["summary"]
        lines.append(
            f"- `{result['command']}`: {summary['mean_angle']:.2f} +- {summary['std_angle']:.2f} rad (best "
            f"{summary['best_angle']:.2f}), {_successes(result)}/{summary['episodes']} successful, "
            f"{summary['kept']} kept the cube, exploits found: {summary['exploits'] or 'none'}"
        )
    return lines


def _successes(result: Results) -> int:
    """Counted again, since files from before 0.3 have another rule."""
    episodes = result["variants"][0]["episodes"]
    return sum(
        one["ending"] == "time_limit" and one["final_angle"] >= SUCCESS_RATE * one["duration"] for one in episodes
    )
