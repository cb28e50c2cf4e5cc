"""A shipped policy's card: what it is, how it was made, what it does, and what it cannot do."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import PolicyInfo
from tactile_cube.errors import InputError

Results = dict[str, Any]


def read_costs(folder: Path) -> dict[str, float]:
    """Read the environment steps of a run and its hours from its ledger.

    Args:
        folder: of the training run.

    Raises:
        InputError: there is none, or it cannot be read.
    """
    path = folder / "ledger.json"
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
        hours = {name: float(ledger[f"{name}_hours"]) for name in ("simulating", "learning", "wall")}
        return {"steps": int(ledger["steps"]), **hours}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not the ledger of a training run ({type(error).__name__}: {error})") from error


def model_card(
    name: str, info: PolicyInfo, runs: Mapping[str, Mapping[str, float]], results: Sequence[Results], limits: str
) -> str:
    """Return the card as Markdown.

    Args:
        name: of the policy.
        info: what its file says.
        runs: costs of the training runs by name, each begun from the one before: "steps", hours of CPU time
            "simulating" and "learning", and of "wall" time.
        results: results files of evaluations of this policy.
        limits: what it cannot do, in the author's words.
    """
    task = info.config.get("task", {})
    filter_time, gravity = task.get("filter_time", "?"), task.get("gravity_scale", "?")
    made = {
        "task": f"{task.get('name', '?')}, T_s {filter_time} s, gravity {gravity}",
        "environment steps": ", then ".join(
            f"{costs['steps']:,} ({run})".replace(",", " ") for run, costs in runs.items()
        ),
        "seed": info.seed,
        "commit": info.commit,
        "CPU hours": f"{_total(runs, 'simulating', 'learning'):.2f} ({_total(runs, 'wall'):.2f} h on the clock)",
        "network": f"{info.observation_size} -> {' -> '.join(map(str, info.hidden))} -> {info.action_size}",
    }
    lines = [
        f"# Policy `{name}`",
        "",
        "Turns an 8 cm cube about the vertical with the DLR-Hand II, by touch alone.",
        "",
    ]
    lines += ["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in made.items())]
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


def _total(runs: Mapping[str, Mapping[str, float]], *names: str) -> float:
    return sum(costs[name] for costs in runs.values() for name in names)


def _measured(results: Sequence[Results]) -> list[str]:
    """One line an evaluation."""
    lines = []
    for result in results:
        summary = result["variants"][0]["summary"]
        lines.append(
            f"- `{result['command']}`: {summary['mean_angle']:.2f} +- {summary['std_angle']:.2f} rad (best "
            f"{summary['best_angle']:.2f}), {summary['successes']}/{summary['episodes']} successful, "
            f"{summary['kept']} kept the cube, exploits found: {summary['exploits'] or 'none'}"
        )
    return lines
