"""A blind round on a page: counts, the confusion matrix, every draw, and its line in the list of all rounds."""

import re
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from benchmarks.blind.generator import VISIBLE

FIRST_SEED = 10_000
RULES = "[benchmarks/blind/scoring.py](../../benchmarks/blind/scoring.py)"
GENERATOR = "[generator](../../benchmarks/blind/generator.py)"
ROUNDS = "[rounds.md](rounds.md)"
TITLES = {"usual": "", "sizes": ": machines of other sizes", "forms": ": other forms of the laws",
          "logs": ": controllers and logs of strangers"}  # fmt: skip
GOAL = 1.3
"""Error on unseen trials in units of the floor that is aimed at."""


def _cell(line: dict[str, Any]) -> str:
    size = "/".join(f"{e['distinct']:.1f}" for e in line["truth"]["effects"]) or "-"
    words = [line["seed"], line["truth"]["rig"], line["score"]["truth"], size, line["score"]["answer"]]
    words += [
        f"{line['score']['outcome']} ({line['score']['why']})",
        *("-" if line[r] is None else f"{line[r]:.2f}" for r in ("noise_ratio", "repeat_ratio")),
        line["wall_seconds"],
    ]
    return "| " + " | ".join(str(w) for w in words) + " |"


FLOORS = {
    "unseen_error_over_sensor_noise": "the true sensor noise",
    "unseen_error_over_repeats": "the scatter of repeats (new joint offsets at each initialisation included)",
}


def _sentence(summary: dict[str, Any], key: str, words: str) -> str:
    v = summary[key]
    if not v["draws"]:
        return f"- error on unseen trials over {words}: none yet"
    return (
        f"- error on unseen trials over {words}, catalogue effects ({v['draws']} draws): median {v['median']:.2f}, "
        f"within {GOAL} in {100 * v[f'within_{GOAL}']:.0f} %, worst {v['worst']:.2f}"
    )


COLUMNS = (
    "adequate",
    "missing_effect, the truth",
    "missing_effect, another",
    "ambiguous",
    "partly_explained",
    "unknown_effect",
    "no answer",
)


def picture(summary: dict[str, Any], path: Path) -> None:
    """The confusion matrix: what was hidden against what was answered."""
    rows = list(summary["confusion"])
    counts = [[summary["confusion"][row].get(column, 0) for column in COLUMNS] for row in rows]
    canvas = Figure(figsize=(8.0, 1.8 + 0.5 * len(rows)), layout="constrained")
    axes = canvas.add_subplot()
    axes.imshow(counts, cmap="Blues", vmin=0)
    axes.set_xticks(range(len(COLUMNS)), [column.replace(", ", ",\n").replace("_", "_\n") for column in COLUMNS])
    axes.tick_params(axis="x", labelsize=8)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_title(f"Blind diagnosis, {summary['draws']} draws: hidden (rows) and answered (columns)", fontsize=10)
    most = max((max(row) for row in counts), default=1)
    for i, row in enumerate(counts):
        for j, count in enumerate(row):
            axes.text(j, i, str(count), ha="center", va="center", color="white" if count > 0.6 * most else "black")
    canvas.savefig(path, dpi=110)


def _drawn(summary: dict[str, Any]) -> str:
    """What the generator did to make effects visible: without it more draws would end in `invisible`."""
    return (
        f"- in {summary['drawn_again']} of {summary['draws']} draws the {GENERATOR} drew the world anew, up to three "
        f"times and at full strength, because the effect moved its joint by less than {VISIBLE:g} times the sensor "
        f"noise; {summary['below_visible']} stayed below that"
    )


def _left_open(summary: dict[str, Any]) -> str:
    sizes = ", ".join(map(str, summary["ambiguous_set_sizes"])) or "-"
    alike = summary.get("said_inseparable", 0)
    return (
        f"- ambiguous answers: {len(summary['ambiguous_set_sizes'])}; candidates that each leaves open: {sizes}; "
        f"answers that say of some that no command tells them apart: {alike}"
    )


def _played(summary: dict[str, Any]) -> str:
    """What the recommended experiments settled once they were played on the hidden rig."""
    turns = "; ".join(f"{turn} {count}" for turn, count in sorted(summary["after_experiment"].items())) or "-"
    return f"- answers after the recommended experiment was played on the hidden rig and its trial added: {turns}"


def _pushes(summary: dict[str, Any]) -> list[str]:
    """How many of the pushes were found; nothing where nobody pushed and nothing was left out."""
    played, found, besides = summary["pushes"]
    if not played and not besides:
        return []
    return [
        f"- trials that somebody pushed in: {played}; pushes left out: {found}; other stretches left out: {besides}"
    ]


def _worlds(command: str) -> str:
    """The worlds that a judge's command names."""
    return command.partition(" --worlds ")[2].partition(" ")[0] or "usual"


def markdown(lines: list[dict[str, Any]], s: dict[str, Any], command: str) -> str:
    """The judged draws and their summary as a page."""
    share = (s["right"] + s["acceptable"]) / max(s["draws"], 1)
    page = [
        f"# Blind diagnosis of hidden effects{TITLES[_worlds(command)]}",
        "",
        f"Command: `{command}`; commit: {', '.join(s['commits'])}. Right, acceptable and wrong are "
        f"defined in {RULES}; all rounds ever run stand in {ROUNDS}.",
        "",
        f"- {s['draws']} draws: {s['right']} right, {s['acceptable']} acceptable, {s['wrong']} wrong "
        f"({s['confidently_wrong']} of them confidently); right or acceptable {100 * share:.0f} %",
        f"- false alarms where nothing is hidden: {s['false_alarms'][0]} of {s['false_alarms'][1]}",
        *(_sentence(s, key, words) for key, words in FLOORS.items()),
        _left_open(s),
        _played(s),
        *_pushes(s),
        _drawn(s),
        f"- median time of a diagnosis: {s['median_seconds']} s",
        "",
        "![confusion matrix](identification.png)",
        "",
        "| hidden | " + " | ".join(COLUMNS) + " |",
        "|---" * (len(COLUMNS) + 1) + "|",
    ]
    page += [f"| {k} | " + " | ".join(str(row.get(c, 0)) for c in COLUMNS) + " |" for k, row in s["confusion"].items()]
    page += ["", "| reason | draws |", "|---|---|"]
    page += [f"| {k} | {n} |" for k, n in sorted(s["reasons"].items())]
    page += [
        "",
        "Size: how far the effect moves its joint [sensor noise], after refitting the plain model's constants.",
        "",
        "| seed | rig | hidden | size | answer | judged | unseen error / noise | / repeats | s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    return "\n".join([*page, *(_cell(x) for x in sorted(lines, key=lambda x: x["seed"])), ""])


def round_row(summary: dict[str, Any], command: str) -> str:
    """The round's line in docs/results/rounds.md, but for remarks on how it ended."""
    options = dict(re.findall(r"(--\S+) (\S+)", command))
    first = options.pop("--first-seed", str(FIRST_SEED))
    outcomes = ", ".join(str(summary[key]) for key in ("right", "acceptable", "wrong"))
    cells = [
        ", ".join([first, options.pop("--draws"), *options.values()]),
        ", ".join(f"`{one}`" for one in summary["commits"]),
        f"{outcomes} ({summary['confidently_wrong']})",
        "{} of {}".format(*summary["false_alarms"]),
    ]
    return f"| {' | '.join(cells)} | ... |"
