"""The runs that a policy comes from, each begun with the one before: what taught them and what they cost."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import load_policy
from tactile_cube.errors import InputError

POLICY, LEDGER = "policy.safetensors", "ledger.json"
HOURS = ("simulating", "learning", "wall")


@dataclass(frozen=True)
class Ancestor:
    """One run.

    Attributes:
        name: of its folder.
        steps: environment steps.
        hours: of CPU time "simulating" and "learning", and of "wall" time.
        config: its training configuration; empty where it was no training, such as the search for a gait.
        commit: of the code that ran it.
    """

    name: str
    steps: int
    hours: Mapping[str, float]
    config: Mapping[str, Any] = field(default_factory=dict)
    commit: str = "not recorded"

    @property
    def cpu_hours(self) -> float:
        """Simulating and learning together."""
        return self.hours["simulating"] + self.hours["learning"]

    @property
    def teacher(self) -> str:
        """Who showed what to do, and whether it was imitated."""
        exploration, agent = self.config.get("exploration", {}), self.config.get("agent", {})
        share, weight = exploration.get("demonstrations", 0), agent.get("demonstration_weight", 0)
        if not share:
            return "none"
        named = exploration.get("teacher")
        who = f"the policy {Path(named).stem}" if named else "a scripted gait"
        return f"{who} in {100 * share:.0f} % of the episodes, imitated with weight {weight:g}"


def read_ancestor(folder: Path) -> Ancestor:
    """Read a run from its ledger and, if it trained one, its policy.

    Args:
        folder: of the run.

    Raises:
        InputError: there is no ledger, or it or the policy cannot be read.
    """
    path = folder / LEDGER
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
        hours = {name: float(ledger[f"{name}_hours"]) for name in HOURS}
        steps = int(ledger["steps"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not the ledger of a run ({type(error).__name__}: {error})") from error
    if not (folder / POLICY).is_file():
        return Ancestor(folder.name, steps, hours)
    info = load_policy(folder / POLICY)[1]
    return Ancestor(folder.name, steps, hours, info.config, info.commit)


def ancestry_table(runs: Sequence[Ancestor]) -> list[str]:
    """The runs as a table, the first one first."""
    head = (
        "| run | steps | CPU hours | begins with | teacher | reward | discount | starts | spinning friction | commit |"
    )
    return [head, "|---" * 10 + "|", *(f"| {' | '.join(_cells(run))} |" for run in runs)]


def _cells(run: Ancestor) -> list[str]:
    cells = [run.name, f"{run.steps:,}".replace(",", " "), f"{run.cpu_hours:.2f}"]
    if not run.config:
        return [*cells, *["-"] * 6, run.commit]
    training, reward, agent, start, env = (
        run.config.get(group) or {} for group in ("training", "reward", "agent", "start", "env")
    )
    weights = ", ".join(
        f"{name} {value:g}" for name, value in reward.items() if isinstance(value, int | float) and value
    )
    friction = (env.get("constants") or {}).get("tip_spinning_friction")
    return [
        *cells,
        str(training.get("init_from") or "fresh networks"),
        run.teacher,
        weights,
        f"{agent.get('gamma', '?')}, {agent.get('n_step', 1)}-step returns",
        f"turned by up to {start.get('yaw_range', 0):g} rad",
        "the nominal of its commit" if friction is None else f"{1000 * friction:g} mm",
        run.commit,
    ]
