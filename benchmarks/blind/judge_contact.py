"""Run record, diagnose and identify on grasps with a hidden contact effect and judge what they answer.

    python -m benchmarks.blind.judge_contact --draws 20 --first-seed 100

Every draw adds one line to verdicts.jsonl in `--out` as soon as it is judged; the same command goes on where it
stopped, and writes contact_identification.md beside it. Seeds below 100 are for tuning.

| hidden | right | acceptable | wrong |
|---|---|---|---|
| nothing | `adequate` | | everything else (a false alarm) |
| an effect | `missing_effect`, it alone | `ambiguous` or `partly_explained` with it, `unknown_effect` | the rest |

`adequate` for a hidden effect is wrong; the reason tells whether identify, told the effect, sees nothing of it either
(the held-out error falls by less than SHOWN). Whether the stated 95 % interval holds the truth is judged apart.
"""

import argparse
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind.judge import commit
from tactile_cube.simulation.contact_effects import contact_catalogue

FIRST_SEED = 100
NOTHING = "nothing"
SHOWN = 0.15  # share of the held-out error that an effect must take off to be seen
# Bounds of the hidden values: half and double of what is typical, and beyond what the stated world has.
RANGES: dict[str, dict[str, tuple[float, float]]] = {
    NOTHING: {},
    "lateral_friction": {"coefficient": (0.3, 0.7)},
    "spinning_friction": {"radius": (0.006, 0.05)},
    "tip_compliance": {"compliance": (2e-4, 1.5e-3)},
    "object_mass": {"excess": (0.03, 0.1)},
    "object_com": {"x": (-0.02, 0.02), "y": (-0.02, 0.02), "z": (-0.02, 0.02)},
    "object_size": {"excess": (0.003, 0.008)},
}
SIGNED = ("object_size",)  # with either sign


def hidden(seed: int) -> tuple[str, dict[str, float]]:
    """What a draw hides: each effect in turn, its values at random (friction by factors)."""
    name = list(RANGES)[seed % len(RANGES)]
    rng = np.random.default_rng(seed)
    values = {
        key: float(np.exp(rng.uniform(*np.log([low, high])))) if low > 0 else float(rng.uniform(low, high))
        for key, (low, high) in RANGES[name].items()
    }
    sign = rng.choice([-1.0, 1.0]) if name in SIGNED else 1.0
    return name, {key: round(sign * value, 6) for key, value in values.items()}


def run(name: str, folder: Path, makes: Path, *words: str) -> Path:
    """One public command as a user types it, unless what it makes is there already."""
    command = [sys.executable, "-m", f"tactile_cube.{name}", *words, f"hydra.run.dir={folder}"]
    done = None if makes.exists() else subprocess.run(command, capture_output=True, text=True, check=False)
    if done is not None and done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}:\n{done.stdout}\n{done.stderr}")
    return makes


def judge(seed: int, folder: Path) -> dict[str, Any]:
    """Record, diagnose, and identify what was hidden (the last to see whether the interval holds it)."""
    name, values = hidden(seed)
    place = folder / f"draw_{seed}"
    said = ", ".join(f"{key}={value}" for key, value in values.items())
    told = [] if name == NOTHING else [f'source.hidden=["{name}: {said}"]']
    recording, diagnosed, identified = (place / name for name in ("recording", "diagnose", "identify"))
    settings = ["source=grasp", f"out={recording}", f"seed={seed}", "source.validation=false"]
    run("record", place / "record", recording / "recording.yaml", *settings, *told)
    words = [f"recording={recording}", f"seed={seed}"]
    diagnosis = json.loads(run("diagnose", diagnosed, diagnosed / "diagnosis.json", *words).read_text())
    line = {"seed": seed, "name": name, "values": values}
    line |= {key: diagnosis[key] for key in ("verdict", "effects", "error", "seconds")}
    if name != NOTHING:
        answer = run("identify", identified, identified / "identification.json", *words, f"effects=[{name}]")
        found = json.loads(answer.read_text())
        line |= {"estimate": found["contact"]["effects"][0]["parameters"], "identify_error": found["error"]}
    return line


def score(line: dict[str, Any]) -> tuple[str, str]:
    """Right, acceptable or wrong, and why."""
    names = [one["name"] for one in line["effects"]]
    verdict, truth = line["verdict"], line["name"]
    if truth == NOTHING:
        return ("right", "nothing hidden") if verdict == "adequate" else ("wrong", "false alarm")
    if verdict == "missing_effect" and names == [truth]:
        return "right", "named"
    if verdict in ("ambiguous", "partly_explained"):
        return ("acceptable", "in the set") if truth in names else ("wrong", "not in the set")
    if verdict == "unknown_effect":
        return "acceptable", "not sure"
    if verdict == "adequate":
        error = line["identify_error"]
        visible = error["with_effects"] < (1 - SHOWN) * error["nominal"]
        return "wrong", "missed" if visible else "missed, identify sees nothing of it either"
    return "wrong", "another effect" if truth not in names else "an effect too many"


def covered(line: dict[str, Any]) -> list[bool]:
    """For each hidden value whether the stated interval holds it."""
    return [line["estimate"][key]["low"] <= v <= line["estimate"][key]["high"] for key, v in line["values"].items()]


def markdown(lines: list[dict[str, Any]], command: str) -> str:
    """The page."""
    lines = sorted(lines, key=lambda line: line["seed"])
    outcomes = Counter(score(line)[0] for line in lines)
    commits = sorted({line.get("commit", "not recorded") for line in lines})
    inside = [one for line in lines if line["values"] for one in covered(line)]
    empty = sum(
        _says_nothing(line["name"], key, one) for line in lines for key, one in line.get("estimate", {}).items()
    )
    page = [
        "# Blind identification of contact effects",
        "",
        f"Command: `{command}`; commit: {', '.join(commits)}. What is right, acceptable and wrong stands at the top "
        "of that file; all rounds stand in [rounds.md](rounds.md).",
        "",
        f"- {len(lines)} draws: {outcomes['right']} right, {outcomes['acceptable']} acceptable, "
        f"{outcomes['wrong']} wrong",
        f"- hidden values within the interval that identify states: {sum(inside)} of {len(inside)}, "
        f"of which {empty} intervals are all that was searched and say nothing",
        "",
        "Held-out error: of what is stated, and with the true effect fitted [mrad].",
        "",
        "| seed | hidden | answer | judged | identify says [95 % interval] | holds the truth | held-out error |",
        "|---|---|---|---|---|---|---|",
    ]
    return "\n".join([*page, *map(_row, lines), ""])


def _says_nothing(effect: str, parameter: str, estimate: dict[str, Any]) -> bool:
    """Whether an interval is the whole range of its parameter."""
    (p,) = (one for one in contact_catalogue()[effect].parameters if one.name == parameter)
    return bool(estimate["low"] <= p.low and estimate["high"] >= p.high)


def _row(line: dict[str, Any]) -> str:
    values = ", ".join(f"{key} {value:.4g}" for key, value in line["values"].items())
    names = (" or " if line["verdict"] == "ambiguous" else " + ").join(one["name"] for one in line["effects"])
    outcome, why = score(line)
    cells = [line["seed"], f"{line['name']} {values}".strip(), f"{line['verdict']}{': ' if names else ''}{names}"]
    cells.append(f"{outcome} ({why})")
    if not line["values"]:
        return f"| {' | '.join(map(str, cells))} | - | - | {1e3 * line['error']['nominal']:.2f} |"
    said = [f"{key} {e['value']:.3g} [{e['low']:.3g}, {e['high']:.3g}]" for key, e in line["estimate"].items()]
    held, error = ["yes" if one else "no" for one in covered(line)], line["identify_error"]
    cells += [", ".join(said), ", ".join(held), f"{1e3 * error['nominal']:.2f} -> {1e3 * error['with_effects']:.2f}"]
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Judge the draws that are not judged yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--out", type=Path, default=Path("outputs/blind_contact"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    file = args.out / "verdicts.jsonl"
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    wanted = range(args.first_seed, args.first_seed + args.draws)
    command = f"python -m benchmarks.blind.judge_contact --draws {args.draws} --first-seed {args.first_seed}"
    for seed in [seed for seed in wanted if seed not in {line["seed"] for line in lines}]:
        lines.append({**judge(seed, args.out), "commit": commit()})
        with file.open("a") as all_lines:
            all_lines.write(json.dumps(lines[-1]) + "\n")
        print(_row(lines[-1]), flush=True)
    page = markdown([line for line in lines if line["seed"] in wanted], command)
    (args.out / "contact_identification.md").write_text(page)
    print(page)


if __name__ == "__main__":
    main()
