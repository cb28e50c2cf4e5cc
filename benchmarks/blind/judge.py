"""Run the public commands on blind recordings and judge what they answer.

    python -m benchmarks.blind.judge --draws 60 --out outputs/blind --jobs 1

Every draw adds one line to verdicts.jsonl as soon as it is judged; the same command goes on where it stopped.
`--draws 0` only sums up what is there, in identification.json beside it. What counts as right stands in scoring.py.
A round to be published runs on a clean commit, with seeds that no round before it used; its line in
docs/results/rounds.md is printed at the end.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.blind.generator import WORLDS, play, write
from benchmarks.blind.scoring import pushes_found, score
from tactile_cube.api.diagnosis import each

FIRST_SEED = 10_000
GOAL = 1.3  # error on unseen trials over the noise floor that is aimed at


def commit() -> str:
    """The commit that is checked out, `-dirty` if a tracked file differs from it; `not recorded` outside a checkout."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    found = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    return found.stdout.strip() or "not recorded"


def run_command(name: str, out: Path, *words: str) -> dict[str, Any] | None:
    """One public command as a user types it; its JSON answer, or None when it failed (its words stay in `out`)."""
    answer = {"diagnose": "diagnosis.json", "compare": "comparison.json"}[name]
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", f"tactile_cube.{name}", *words, f"hydra.run.dir={out}"]
    with (out / "words.txt").open("w") as words_of_verb:
        subprocess.run(command, stdout=words_of_verb, stderr=subprocess.STDOUT, check=False)
    path = out / answer
    if not path.is_file():
        return None
    text = path.read_text().replace(f"{out.resolve()}/", "")  # a result names no machine's folders
    return dict(json.loads(text))


def validation_error(recording: Path, model: Path, out: Path) -> float | None:
    """Overall RMS of the recommended model on trials that the diagnosis never saw [rad]."""
    if not model.is_file():
        return None
    words = (f"recording={recording / 'validation'}", f"model={model}", "band.simulations=0", "rerun=false")
    answer = run_command("compare", out, *words)
    return None if answer is None else float(answer["error"]["overall"])


def judge(
    folder: Path, seconds: float | None, keep: bool, engine: str, worlds: str, pushes: int, seed: int
) -> dict[str, Any]:
    """Generate, diagnose, compare and judge one seed."""
    place = folder / f"draw_{seed}"
    truth = write(seed, place, seconds, engine=engine, worlds=worlds, pushes=pushes)
    started = time.perf_counter()
    diagnosis = run_command("diagnose", place / "diagnose", f"recording={place / 'recording'}")
    wall = time.perf_counter() - started
    line: dict[str, Any] = {"seed": seed, "truth": truth, "diagnosis": diagnosis, "wall_seconds": round(wall, 1)}
    line["commit"] = commit()
    if diagnosis is None:
        return line
    model = place / "diagnose" / "model.yaml"
    line["validation_error"] = validation_error(place / "recording", model, place / "validation")
    experiment = place / "diagnose" / "next_experiment.csv"
    if experiment.is_file():
        line["after_experiment"] = settled(place, experiment, seconds, engine, worlds)
    if not keep:
        shutil.rmtree(place / "recording")
        shutil.rmtree(place / "diagnose")
        shutil.rmtree(place / "diagnose_again", ignore_errors=True)
    return line


def settled(place: Path, experiment: Path, seconds: float | None, engine: str, worlds: str) -> dict[str, Any]:
    """What is answered once the recommended experiment has been played on the rig, and its error on unseen trials."""
    play(place, experiment, seconds, engine, worlds)
    out = place / "diagnose_again"
    diagnosis = run_command("diagnose", out, f"recording={place / 'recording'}")
    error = validation_error(place / "recording", out / "model.yaml", place / "validation_again")
    return {"diagnosis": diagnosis, "validation_error": error}


def judged(line: dict[str, Any]) -> dict[str, Any]:
    """The line with its score and the error on unseen trials in units of sensor noise and of the repeats' scatter."""
    scored = _scored(line)
    if again := line.get("after_experiment"):
        scored["after_experiment"] = _scored({"truth": line["truth"], **again})
    return scored


def _scored(line: dict[str, Any]) -> dict[str, Any]:
    truth, diagnosis, error = line["truth"], line["diagnosis"], line.get("validation_error")
    ratios = {
        "noise_ratio": None if error is None else error / truth["sensor_floor"],
        "repeat_ratio": None if error is None else error / truth["repeat_scatter"],
    }
    if diagnosis is None:
        found = {"outcome": "wrong", "why": "no answer", "truth": "", "answer": "no answer", "confident": False}
    else:
        found = asdict(score(truth, diagnosis, ratios["noise_ratio"]))
    return {**line, **ratios, "score": found}


def _spread(values: list[float | None]) -> dict[str, Any]:
    """Median, share within the goal and worst of the ratios there are."""
    there = sorted(v for v in values if v is not None)
    if not there:
        return {"draws": 0}
    within = sum(v <= GOAL for v in there) / len(there)
    return {"draws": len(there), "median": there[len(there) // 2], f"within_{GOAL}": within, "worst": there[-1]}


def _answer_class(line: dict[str, Any]) -> str:
    verdict = line["diagnosis"]["verdict"] if line["diagnosis"] else "no answer"
    if verdict != "missing_effect":
        return str(verdict)
    return "missing_effect, the truth" if line["score"]["outcome"] != "wrong" else "missing_effect, another"


def _truth_class(line: dict[str, Any]) -> str:
    effects = line["truth"]["effects"]
    if not effects:
        return "nothing"
    if len(effects) == 2:
        return "two effects"
    if "names" in effects[0]:
        return "another form"
    return "one effect" if effects[0]["in_catalogue"] else "outside the catalogue"


def in_words(found: dict[str, Any]) -> str:
    """A score as a line of the terminal."""
    return f"{found['truth']}  ->  {found['answer']}  {found['outcome']} ({found['why']})"


def set_size(diagnosis: dict[str, Any]) -> int:
    """How many candidates an ambiguous answer leaves open."""
    return len({n for e in diagnosis["effects"] for n in [f"{e['name']}@{e['joints']}", *e.get("rivals", [])]})


def summarise(lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts, shares, the confusion matrix and how near the validation error came to the floor."""
    outcomes = Counter(x["score"]["outcome"] for x in lines)
    none = [x for x in lines if not x["truth"]["effects"]]
    known = [x for x in lines if x["truth"]["effects"] and all(e["in_catalogue"] for e in x["truth"]["effects"])]
    sets = sorted(set_size(x["diagnosis"]) for x in lines if x["score"]["answer"].startswith("ambiguous"))
    played = [x for x in lines if "after_experiment" in x]
    pushes = [pushes_found(x["truth"].get("pushes", []), x["diagnosis"] or {}) for x in lines]
    matrix: dict[str, Counter[str]] = {}
    for line in lines:
        matrix.setdefault(_truth_class(line), Counter())[_answer_class(line)] += 1
    return {
        "draws": len(lines),
        "right": outcomes["right"],
        "acceptable": outcomes["acceptable"],
        "wrong": outcomes["wrong"],
        "confidently_wrong": sum(x["score"]["confident"] for x in lines),
        "false_alarms": [sum(x["score"]["outcome"] == "wrong" for x in none), len(none)],
        "ambiguous_set_sizes": sets,
        "said_inseparable": sum(bool((x["diagnosis"] or {}).get("inseparable")) for x in lines),
        "after_experiment": dict(
            Counter(f"{x['score']['outcome']}, then {x['after_experiment']['score']['outcome']}" for x in played)
        ),
        "pushes": [sum(column) for column in zip(*pushes, strict=True)] if pushes else [0, 0, 0],
        "commits": sorted({x.get("commit", "not recorded") for x in lines}),
        "drawn_again": sum(x["truth"].get("drawn", 1) > 1 for x in lines),
        "below_visible": sum(not x["truth"].get("visible", True) for x in lines),
        "reasons": dict(Counter(f"{x['score']['outcome']}: {x['score']['why']}" for x in lines)),
        "confusion": {k: dict(v) for k, v in matrix.items()},
        "unseen_error_over_sensor_noise": _spread([x["noise_ratio"] for x in known]),
        "unseen_error_over_repeats": _spread([x["repeat_ratio"] for x in known]),
        "median_seconds": sorted(x["wall_seconds"] for x in lines)[len(lines) // 2] if lines else None,
    }


def read_lines(path: Path) -> list[dict[str, Any]]:
    """The draws judged so far."""
    return [json.loads(x) for x in path.read_text().splitlines()] if path.is_file() else []


def report(folder: Path, command: str) -> dict[str, Any]:
    """Write identification.json from the lines so far; returns the summary."""
    lines = [judged(x) for x in read_lines(folder / "verdicts.jsonl")]
    summary = summarise(lines)
    (folder / "identification.json").write_text(
        json.dumps({"command": command, **summary, "draws_judged": lines}, indent=1)
    )
    return summary


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


def main() -> None:
    """Judge the draws that are not judged yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=60)
    parser.add_argument("--out", type=Path, default=Path("outputs/blind"))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--seconds", type=float, help="length of every trial (default: drawn)")
    parser.add_argument("--engine", choices=("own", "mujoco"), default="own", help="what moves the measured rigs")
    parser.add_argument("--worlds", choices=tuple(WORLDS), default="usual", help="what is measured")
    parser.add_argument("--pushes", type=int, default=0, help="trials of each draw that somebody pushes in")
    parser.add_argument("--keep", action="store_true", help="keep recordings and answers")
    args = parser.parse_args()
    if args.engine != "own" and args.worlds != "usual":
        parser.error(f"--engine {args.engine} moves the usual worlds only, got --worlds {args.worlds}")
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    args.out.mkdir(parents=True, exist_ok=True)
    done = {x["seed"] for x in read_lines(args.out / "verdicts.jsonl")}
    wanted = [s for s in range(args.first_seed, args.first_seed + args.draws) if s not in done]
    command = f"python -m benchmarks.blind.judge --draws {args.draws or len(done)} --first-seed {args.first_seed}"
    command += f" --seconds {args.seconds:g}" if args.seconds else ""
    command += f" --engine {args.engine}" * (args.engine != "own")
    command += f" --worlds {args.worlds}" * (args.worlds != "usual")
    command += f" --pushes {args.pushes}" * (args.pushes > 0)
    work = partial(judge, args.out, args.seconds, args.keep, args.engine, args.worlds, args.pushes)
    for _, line in each(work, wanted, args.jobs):
        with (args.out / "verdicts.jsonl").open("a") as lines:
            lines.write(json.dumps(line) + "\n")
        print(f"{line['seed']}  {in_words(judged(line)['score'])}", flush=True)
        if "after_experiment" in line:
            again = judged(line)["after_experiment"]["score"]
            print(f"        after the next experiment: {in_words(again)}", flush=True)
        report(args.out, command)
    summary = report(args.out, command)
    print(json.dumps({k: v for k, v in summary.items() if k != "draws_judged"}, indent=1))
    print(f"line for docs/results/rounds.md:\n{round_row(summary, command)}")


if __name__ == "__main__":
    main()
