"""The paper's single results, one row each, filled from the results files of evaluate."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.paper.model_card import read_card
from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import FORMAT
from tactile_cube.evaluation.policy_path import SHIPPED
from tactile_cube.evaluation.summary import wilson_interval

Results = dict[str, Any]
EVALUATE = "python -m tactile_cube.evaluate"
TRAIN = (
    "python -m tactile_cube.train +experiment=curriculum` at 9810f65, ended by hand after 262 500 steps, then, after "
    "337 500, `+experiment=finetune training.init_from=outputs/train/curriculum-seed0/checkpoint.pt agent.gamma=0.95 "
    "training.replay_size=300000"
)
"""With the recipes of the commits that made `published`; today's `curriculum` is another."""
KEYS = ("created", "protocol", "policy", "task", "seed", "command", "cpu_hours", "variants")  # of every results file
HEAD = "| experiment | paper | here | command | commit |"
SCRIPTED, REPLAY = "scripted", "replay"
FINGER = "outputs/finger"
FREE_FINGER = f"python -m tactile_cube.record out={FINGER}` and `python -m tactile_cube.compare recording={FINGER}"


@dataclass(frozen=True)
class Row:
    """One result of the paper.

    Attributes:
        what: the experiment.
        paper: the paper's number. Source: paper, section IV and the authors' website.
        protocol: of conf/protocol that repeats it.
        ours: our number from the results.
        policy: "scripted" for the hand-crafted trajectory, "replay" for the targets of a recorded episode, "" for any
            trained policy.
        words: of the command besides, which say whose worlds are drawn; empty: the protocol's.
        made_by: the command, where it is not the evaluation.
    """

    what: str
    paper: str
    protocol: str
    ours: Callable[[Results], str]
    policy: str = ""
    words: str = ""
    made_by: str = ""

    @property
    def command(self) -> str:
        """The command that fills the row."""
        if self.made_by:
            return self.made_by
        name = "replay:EPISODE.npz" if self.policy == REPLAY else self.policy
        policy = f"policy={name} " if name else ""
        return " ".join(f"{EVALUATE} {policy}protocol={self.protocol} {self.words}".split())

    def fits(self, results: Results) -> bool:
        """Whether results fill this row: the cube at full weight in the air, as in the paper."""
        task = results["task"]
        if task["table"] or task["gravity_scale"] < 1.0:
            return False
        kind = str(results["policy"]["label"]).partition(" of ")[0]
        fits_policy = kind == self.policy if self.policy else kind not in ("hold", "random", SCRIPTED, REPLAY)
        return bool(results["protocol"] == self.protocol) and fits_policy and _worlds(results) == self.words


def _worlds(results: Results) -> str:
    """The words of the command that choose worlds: randomisation, start, or whose a protocol takes."""
    words = str(results["command"]).split()
    return " ".join(word for word in words if word.partition("=")[0] in ("protocol.worlds", "randomization", "start"))


def paper_rows(results: Sequence[Results], free_finger: Mapping[str, Any] | None) -> str:
    """Return the table, the newest results that fit in each row.

    Args:
        results: what `read_results` gave, the newest last.
        free_finger: from `read_comparison`.
    """
    lines, before = [HEAD, "|---" * HEAD.count(" |") + "|"], ""
    for row in ROWS:
        found = newest(results, row.fits)
        if found is None:
            lines.append(f"| {row.what} | {row.paper} | not run | `{row.command}` | |")
            continue
        command = row.made_by or typed(found["command"])
        commit = found["policy"].get("commit") if row.made_by else found.get("commit")
        made = f"`{command}`" if command != before else "the same"
        lines.append(f"| {row.what} | {row.paper} | {row.ours(found)} | {made} | {commit or 'not recorded'} |")
        before = command
    lines.append(_free_finger_row(free_finger))
    return "\n".join(lines)


def typed(command: str) -> str:
    """A command without what changes none of its numbers: film and run folder."""
    kept = (word for word in command.split() if word.partition("=")[0] not in ("film", "hydra.run.dir"))
    return " ".join(kept)


def _free_finger_row(comparison: Mapping[str, Any] | None) -> str:
    """The paper's figure 4: what is measured lies among randomised simulations."""
    what = "one finger in free space, open loop (figure 4)"
    paper = "15 recordings of 3 initialisations lie among 50 randomised simulations"
    if comparison is None:
        return f"| {what} | {paper} | not run | `{FREE_FINGER}` | |"
    band, trials = comparison["band"], comparison["trials"]
    starts = len({trial["initialisation"] for trial in trials})
    ours = (
        f"{100 * band['inside']:.0f} % of the samples of {len(trials)} recordings of {starts} initialisations of a "
        f"simulated finger lie among {band['simulations']}"
    )
    return f"| {what} | {paper} | {ours} | `{FREE_FINGER}` | {comparison.get('commit', 'not recorded')} |"


def newest(results: Sequence[Results], fits: Callable[[Results], bool]) -> Results | None:
    """Return the last of the results that fit."""
    return next((one for one in reversed(results) if fits(one)), None)


def read_results(path: Path) -> Results:
    """Read a results file.

    Raises:
        InputError: it is missing, damaged or something else.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: not a results file of evaluate: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f"{path}: not a results file of evaluate (expected format {FORMAT!r})")
    missing = [key for key in KEYS if key not in data]
    if missing:
        raise InputError(f"{path}: results without {', '.join(missing)}; run evaluate again")
    return data


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


def summary_of(results: Results, variant: int = 0) -> dict[str, Any]:
    """Return the summary of a variant."""
    summary: dict[str, Any] = results["variants"][variant]["summary"]
    return summary


SHARE = 0.8
"""Of the best run's angle, from which on the paper counts a run that keeps the cube. Source: paper, section IV."""


def _outcome(results: Results) -> str:
    """Kept, as far as the paper counts, and angle together."""
    summary, episodes = summary_of(results), results["variants"][0]["episodes"]
    least = SHARE * max(episode["final_angle"] for episode in episodes)
    far = sum(episode["ending"] == "time_limit" and 0.0 < least <= episode["final_angle"] for episode in episodes)
    low, high = (round(100 * end) for end in wilson_interval(far, len(episodes)))
    of = f"/{len(episodes)}"
    return (
        f"{summary['kept']}{of} kept, {far}{of} as far (95 %: {low} to {high} %), "
        f"{summary['mean_angle']:.1f} +- {summary['std_angle']:.1f} rad"
    )


def _best(results: Results) -> str:
    return f"{summary_of(results)['best_angle']:.1f} rad"


def _longest(results: Results) -> str:
    """The episode that turned farthest: angle, turns, time, ending."""
    best = max(results["variants"][0]["episodes"], key=lambda episode: episode["final_angle"])
    turns = best["final_angle"] / (2 * math.pi)
    minutes = best["duration"] / 60
    return f"{best['final_angle']:.0f} rad, {turns:.1f} turns, {minutes:.1f} min, {best['ending'].replace('_', ' ')}"


def _replayed(results: Results) -> str:
    """Kept and mean angle of the replay, and of the policy in the same world, at each displacement of the start."""
    names = [one["variant"]["name"].rpartition(", start ") for one in results["variants"]]
    shown = [
        f"{aside.removesuffix(' aside')}: {_kept(results, n)} (policy {_kept(results, n + 1)})"
        for n, (name, _, aside) in enumerate(names)
        if name.startswith(REPLAY)
    ]
    return "; ".join(shown)


def _kept(results: Results, variant: int) -> str:
    summary = summary_of(results, variant)
    return f"{summary['kept']}/{summary['episodes']}, {summary['mean_angle']:.1f} rad"


def _with_endings(results: Results) -> str:
    summary = summary_of(results)
    kept = f"{summary['kept']}/{summary['episodes']} kept"
    return f"best {summary['best_angle']:.1f}, mean {summary['mean_angle']:.1f} rad; {kept}"


def _verdicts(name: str) -> Callable[[Results], str]:
    """How many episodes ended with a verdict."""
    return lambda results: f"{summary_of(results)['verdicts'][name]}/{summary_of(results)['episodes']}"


def _training_cost(results: Results) -> str:
    """Hours and demonstrations of the policy's card, where it comes with the package."""
    file = SHIPPED / f"{results['policy']['label']}.md"
    if not file.is_file():
        return "see the ledger of its run"
    card = read_card(file)
    return f"{card['CPU hours']}; demonstrations: {card['demonstrations']}"


ROWS = (
    Row("CPU hours of training", "600, without demonstrations", "paper", _training_cost, made_by=TRAIN),
    Row("10 runs of 40 s, at least 80 % of the best run", "robot 8/10, simulation 9/10", "paper", _outcome),
    Row("best of these runs", "15 rad", "paper", _best),
    Row("the same, 100 runs", "-", "many", _outcome),
    Row("10 runs in the worlds of its training", "-", "paper", _outcome, words="protocol.worlds=training"),
    Row("endurance, at most 16 min", "289 rad, 46 turns, stopped by hand", "endurance", _longest),
    Row("open-loop replay of a successful run, start displaced by", "fails after pi/2", "replay", _replayed),
    Row("the replay in other worlds", "fails after pi/2", "standard", _with_endings, REPLAY),
    Row("the policy in the same worlds", "-", "standard", _with_endings, words="start=paper randomization=paper"),
    Row("hand-crafted trajectory", "11 rad, then drops", "paper", _with_endings, SCRIPTED),
    Row("failure (a): stuck with twisted fingers", "until q1 was penalised", "many", _verdicts("stuck_twisted")),
    Row("failure (c): turns on and drops it", "seen", "many", _verdicts("spun_and_dropped")),
)
"""Source: paper, section IV, and the authors' website."""
