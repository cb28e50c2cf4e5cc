"""A shipped policy's card: what it is, how it was made, what it does, and what it cannot do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import PolicyInfo, load_actor
from tactile_cube.agent.policy_parts import making
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import SHIPPED
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
        "demonstrations": "; ".join(f"{run.shown} ({run.name})" for run in trained if run.shown != NONE) or NONE,
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


POLICY, LEDGER = "policy.safetensors", "ledger.json"
SETTINGS = ("begins with", "demonstrations", "reward", "discount", "starts", "spinning friction")
HEAD = ("run", "steps", "CPU hours", "on the clock [h]", *SETTINGS, "commit")
UNKNOWN, NONE = "not recorded", "none"
SEARCH = "search_gait"


@dataclass(frozen=True)
class Ancestor:
    """One run.

    Attributes:
        name: of its folder.
        steps: environment steps; None where they were not recorded.
        cpu_hours: of simulating and learning; None where they were not recorded.
        wall_hours: on the clock; None where they were not recorded.
        settings: of `SETTINGS`, in words; empty where it was no training, such as the search for a gait.
        commit: of the code that ran it.
    """

    name: str
    steps: int | None = None
    cpu_hours: float | None = None
    wall_hours: float | None = None
    settings: Mapping[str, str] = field(default_factory=dict)
    commit: str = UNKNOWN

    @property
    def shown(self) -> str:
        """Demonstrations that the run had, and whether it imitated them."""
        return self.settings.get("demonstrations", NONE)


def read_ancestry(folders: Sequence[Path]) -> list[Ancestor]:
    """Read runs, and before each one what it rests on: where it began, the search for its gait.

    Args:
        folders: of the runs, the first one first, the policy's own the last. A run that began with that of a folder
            beside it, or with a policy that comes with the package, brings that one's ancestry by itself.

    Raises:
        InputError: there is no ledger, or it or the policy cannot be read.
    """
    given = {folder.name for folder in folders}
    return _once(one for folder in folders for one in _with_ancestors(folder, given))


def _with_ancestors(folder: Path, given: set[str]) -> list[Ancestor]:
    steps, cpu_hours, wall_hours = _costs(folder / LEDGER)
    if not (folder / POLICY).is_file():
        return [Ancestor(folder.name, steps, cpu_hours, wall_hours)]
    info = load_actor(folder / POLICY)[1]
    with making(str(folder / POLICY)):
        exploration, start = info.config.get("exploration") or {}, (info.config.get("training") or {}).get("init_from")
        before = _named(Path(start), folder.parent, given | {folder.name}) if start else []
        before += _search(exploration)
        return [*before, Ancestor(folder.name, steps, cpu_hours, wall_hours, in_words(info.config), info.commit)]


def _named(path: Path, beside: Path, given: set[str]) -> list[Ancestor]:
    """The ancestry of a run in the folder `beside`, or of a policy of the package; else its name alone."""
    folder = path if path.is_dir() else path.parent
    if {folder.name, folder.parent.name} & given:  # a stage of a training has its costs in those of the whole
        return []
    if folder.resolve().parent == beside.resolve() and (folder / LEDGER).is_file():
        return _with_ancestors(folder, given)
    card = SHIPPED / f"{path.stem}.md"
    if card.is_file() and (path.parent == SHIPPED or path.name == path.stem):
        return read_table(card.read_text(encoding="utf-8"))
    return [Ancestor(folder.name if path.suffix == ".pt" else path.name)]


def _search(exploration: Mapping[str, Any]) -> list[Ancestor]:
    """The search for the scripted gait of the demonstrations; its cost is unknown unless the gaits state it."""
    if not exploration.get("demonstrations"):
        return []
    return [Ancestor(**{"name": SEARCH, **((exploration.get("gaits") or {}).get("search") or {})})]


def _costs(path: Path) -> tuple[int, float, float]:
    """Steps, CPU hours and hours on the clock of a ledger."""
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
        simulating, learning, wall = (float(ledger[f"{name}_hours"]) for name in ("simulating", "learning", "wall"))
        return int(ledger["steps"]), simulating + learning, wall
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not the ledger of a run ({type(error).__name__}: {error})") from error


def _once(runs: Iterable[Ancestor]) -> list[Ancestor]:
    """Each run once, where it comes first."""
    kept: list[Ancestor] = []
    for run in runs:
        if not any((one.name, one.steps) == (run.name, run.steps) for one in kept):
            kept.append(run)
    return kept


def in_words(config: Mapping[str, Any]) -> dict[str, str]:
    """The `SETTINGS` of a training configuration."""
    training, reward, agent, start, env = (
        config.get(group) or {} for group in ("training", "reward", "agent", "start", "env")
    )
    weights = [f"{name} {value:g}" for name, value in reward.items() if isinstance(value, int | float) and value]
    friction = (env.get("constants") or {}).get("tip_spinning_friction")
    return {
        "begins with": str(training.get("init_from") or "fresh networks"),
        "demonstrations": _demonstrations(config.get("exploration") or {}, agent),
        "reward": ", ".join(weights),
        "discount": f"{agent.get('gamma', '?')}, {agent.get('n_step', 1)}-step returns",
        "starts": _starts(start),
        "spinning friction": "the nominal of its commit" if friction is None else f"{1000 * friction:g} mm",
    }


def _starts(start: Mapping[str, Any]) -> str:
    if str(start.get("_target_", "")).endswith("GraspStarts"):
        return "in stable grasps" if start.get("share", 1.0) == 1.0 else f"{100 * start['share']:g} % in stable grasps"
    return f"turned by up to {start.get('yaw_range', 0):g} rad"


def _demonstrations(exploration: Mapping[str, Any], agent: Mapping[str, Any]) -> str:
    share, weight = exploration.get("demonstrations", 0), agent.get("demonstration_weight", 0)
    if not share:
        return NONE
    return f"a scripted gait in {100 * share:.0f} % of the episodes, imitated with weight {weight:g}"


def ancestry_table(runs: Sequence[Ancestor]) -> list[str]:
    """The runs as a table, the first one first."""
    return [f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|", *(f"| {' | '.join(_cells(run))} |" for run in runs)]


def _cells(run: Ancestor) -> list[str]:
    steps = UNKNOWN if run.steps is None else f"{run.steps:,}".replace(",", " ")
    hours = [UNKNOWN if value is None else _hours(value) for value in (run.cpu_hours, run.wall_hours)]
    return [run.name, steps, *hours, *(run.settings.get(key, "-") for key in SETTINGS), run.commit]


def read_table(text: str) -> list[Ancestor]:
    """Read the runs back from a page with the table of `ancestry_table`."""
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    runs = [dict(zip(HEAD, row, strict=True)) for row in rows if len(row) == len(HEAD) and tuple(row) != HEAD]
    return [_ancestor(run) for run in runs]


def _ancestor(row: Mapping[str, str]) -> Ancestor:
    steps = None if row["steps"] == UNKNOWN else int(row["steps"].replace(" ", ""))
    cpu, wall = (None if row[key] == UNKNOWN else float(row[key]) for key in ("CPU hours", "on the clock [h]"))
    settings = {key: row[key] for key in SETTINGS if row[key] != "-"}
    return Ancestor(row["run"], steps, cpu, wall, settings, row["commit"])


def _hours(value: float) -> str:
    return f"{value:.3g}"


def total(runs: Sequence[Ancestor]) -> str:
    """CPU hours and hours on the clock of all runs, as the table shows each of them, and whose are missing."""
    cpu, wall = (sum(float(_hours(getattr(run, key) or 0.0)) for run in runs) for key in ("cpu_hours", "wall_hours"))
    lost = [run.name for run in runs if run.cpu_hours is None]
    return f"{cpu:.2f} ({wall:.2f} h on the clock)" + (f", without {', '.join(lost)} ({UNKNOWN})" if lost else "")
