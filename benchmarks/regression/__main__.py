"""Diagnose known recordings again: what a change of the search has made better or worse.

    python -m benchmarks.regression --out outputs/regression --keep tests/identification/evidence.json.gz

One process, one line a recording; the same command goes on where it stopped. What is kept are the statistics of the
sets that were judged, by which the tests decide again with other criteria. What counts as right stands in
benchmarks/blind/scoring.py. These draws are spent: they say what has changed, and never how good a search is.
"""

import argparse
import gzip
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from benchmarks.blind.generator import write
from benchmarks.blind.scoring import score
from benchmarks.regression.evidence import stored
from tactile_cube.api.comparison import compare
from tactile_cube.api.diagnosis import diagnose
from tactile_cube.drivetrain.model_file import write_model
from tactile_cube.whole_file import write_whole

OUTCOMES = ("right", "acceptable", "wrong")
"""The best one first."""
DRAWS = Path(__file__).with_name("draws.yaml")


def draws() -> list[dict[str, Any]]:
    """The recordings: a seed, the words of its generator, and the outcome that is expected."""
    return list(yaml.safe_load(DRAWS.read_text()))


def judged(draw: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Make one recording, diagnose it as a user does, and judge the answer."""
    words = {key: value for key, value in draw.items() if key != "expects"}
    truth = write(out=folder, **words)
    progress: list[str] = []
    began = time.process_time()
    found = diagnose(folder / "recording", say=progress.append)
    seconds = time.process_time() - began
    assert found.free is not None, "these are recordings of free motion"
    write_model(found.model, folder / "model.yaml")
    unseen = compare(folder / "recording" / "validation", values={"band.simulations": 0}, model=folder / "model.yaml")
    ratio = unseen.error / truth["sensor_floor"]
    one = score(truth, found.data, ratio)
    return {
        "seed": draw["seed"],
        "truth": one.truth,
        "answer": one.answer,
        "verdict": found.verdict,
        "named": [sorted(one) for one in found.data["sets"] or [found.effects] if one],
        "outcome": one.outcome,
        "why": one.why,
        "confident": one.confident,
        "expects": draw["expects"],
        "unseen": round(ratio, 3),
        "seconds": round(seconds, 1),
        "progress": progress,
        "evidence": stored(found.free.findings),
    }


def main() -> None:
    """Judge what is not judged yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("outputs/regression"))
    parser.add_argument("--only", type=int, nargs="+", help="these seeds")
    parser.add_argument("--keep", type=Path, help="write the evidence of all answers here")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    answers = args.out / "answers.jsonl"
    done = {json.loads(x)["seed"] for x in answers.read_text().splitlines()} if answers.is_file() else set()
    failed = False
    for draw in draws():
        if draw["seed"] in done or (args.only and draw["seed"] not in args.only):
            continue
        with tempfile.TemporaryDirectory() as folder:
            one = judged(draw, Path(folder))
        with answers.open("a") as lines:
            lines.write(json.dumps(one) + "\n")
        failed |= OUTCOMES.index(one["outcome"]) > OUTCOMES.index(one["expects"])
        line = f"{one['seed']} {one['truth']} -> {one['answer']} {one['named']}"
        print(f"{line} {one['outcome']} ({one['why']}), unseen {one['unseen']}, {one['seconds']} CPU s", flush=True)
    if args.keep:
        keep(answers, args.keep)
    sys.exit(failed)


def keep(answers: Path, file: Path) -> None:
    """Write the evidence of all answers that were as good as expected, with the answers."""
    rows = [json.loads(line) for line in answers.read_text().splitlines()]
    tables = {
        str(row["seed"]): {key: row[key] for key in ("truth", "verdict", "named", "evidence")}
        for row in rows
        if OUTCOMES.index(row["outcome"]) <= OUTCOMES.index(row["expects"])
    }
    write_whole(file, gzip.compress(json.dumps(tables).encode(), mtime=0))


if __name__ == "__main__":
    main()
