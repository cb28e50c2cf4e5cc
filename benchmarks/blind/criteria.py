"""What half and double each number that decides a diagnosis does to blind draws that are spent.

    python -m benchmarks.blind.criteria outputs/own --draws 20 --out outputs/criteria

Takes the draws of a round that judge.py kept (`--keep`), searches each once with the numbers of conf/criteria, then
with one of them changed at a time; what was fitted before is not fitted again. Errors are halved and doubled in what
they are above 1, a perfect model's error; shares above a half in what they are below 1. The search is the one in
short segments; what it leaves is not asked again in longer ones. Adds a line to answers.jsonl for each draw; goes on
where it stopped; criteria.md sums them up. What an answer is worth says scoring.py, with the held-out error in place of
that on unseen trials.
"""

from __future__ import annotations

import argparse
import json
import pickle
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import tactile_cube
from benchmarks.blind.scoring import score
from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.identification.criteria import STANDARD, Criteria
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.resolution import resolved
from tactile_cube.identification.search import findings as finding
from tactile_cube.identification.search import search as searching
from tactile_cube.identification.search.division import Division
from tactile_cube.identification.search.evidence import Judgement
from tactile_cube.identification.search.explanation import Explanation, Proposal, least_gain
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.search.together import Together
from tactile_cube.identification.verdict import Simulations, Unexplained, Verdict, decide
from tactile_cube.measurement.comparing.noise_floor import noise_floor, sensor_noise
from tactile_cube.measurement.replay.model import Model
from tactile_cube.measurement.split import held_out_split, turned, with_test_part

T = TypeVar("T")
ERRORS = ("floor", "adequate", "tolerated", "far")


class Memory:
    """What was found once for the same question is not looked for again."""

    def remembered(self, question: tuple[Any, ...], find: Callable[[], T]) -> T:
        """The answer found before, or else found now."""
        known: dict[bytes, Any] = self.__dict__.setdefault("known_answers", {})
        key = pickle.dumps(question)
        if key not in known:
            known[key] = find()
        return known[key]  # type: ignore[no-any-return]


class Remembered(Memory, Division):
    """A division of the trials."""

    def fit_base(self) -> Explanation:
        return self.remembered(("base",), super().fit_base)

    def settled(self, model: Model) -> tuple[Fit, Judgement]:
        return self.remembered(("settled", model), lambda: super(Remembered, self).settled(model))


class Folds:
    """Makes the divisions of one recording, each once."""

    def __init__(self) -> None:
        self.made: dict[int, tuple[Any, Remembered]] = {}

    def __call__(self, shooting: Any, fitted: Any, held_out: Any, *more: Any) -> Remembered:
        if id(held_out) not in self.made:
            self.made[id(held_out)] = held_out, Remembered(shooting, fitted, held_out, *more)
        return self.made[id(held_out)][1]


class RememberingSearch(Remembered, Search):
    """A search that can be run again with other criteria."""

    def extend(self, parent: Explanation, base: Explanation) -> list[Explanation]:
        def find() -> tuple[list[Explanation], list[Any], list[Proposal]]:
            return super(RememberingSearch, self).extend(parent, base), self.last_scores, self.leaders

        needed = least_gain(parent, base, self.criteria)
        question = ("extend", parent.label, parent.fit.model, needed, self.criteria.least_gain)
        found, self.last_scores, leaders = self.remembered(question, find)
        self.leaders = self.leaders or leaders
        return found

    def answer(self, criteria: Criteria, simulations: Simulations | None) -> tuple[Verdict, Simulations]:
        """The verdict by other criteria."""
        self.criteria, self.leaders = criteria, []
        findings = finding.find(self)
        asked = simulations or RememberingSimulations(self, findings.base, self.floor, "fast", 0.002)  # type: ignore[attr-defined]
        return decide(findings, asked, criteria), asked


class RememberingTogether(Memory, Together):
    """Sets of effects, whose growth depends on the recording and one number alone."""

    def grown(self, parent: Proposal, sizes: Any) -> list[Proposal]:
        question = ("grown", parent.fit.model, tuple(sizes), self.criteria.least_gain)
        return self.search.remembered(  # type: ignore[attr-defined,no-any-return]
            question, lambda: super(RememberingTogether, self).grown(parent, sizes)
        )


class RememberingSimulations(Memory, Simulations):
    """Answers to what a decision asks, kept too."""

    def unexplained(self, one: Explanation, beside_base: bool = False) -> list[Unexplained]:
        question = ("unexplained", one.fit.model, beside_base, self.search.criteria.tolerated)
        return self.remembered(question, lambda: super(RememberingSimulations, self).unexplained(one, beside_base))


def opened(folder: Path) -> RememberingSearch:
    """The search of a recording, divided as `diagnose` does."""
    effects = list(catalogue().values())
    recording = resolved(tactile_cube.read_recording(folder), effects, lambda line: None)
    fitted, held_out = held_out_split(recording)
    fitted, _ = with_test_part(fitted, len(recording.trials))
    noise = sensor_noise(recording)
    searching.Division = Folds()  # type: ignore[misc,attr-defined,assignment]
    search = RememberingSearch(
        fitted, held_out, noise, effects, lambda line: None, folds=turned(fitted, held_out)
    )  # fmt: skip
    search.floor = noise_floor(recording)  # type: ignore[attr-defined]
    return search


def changed(name: str, factor: float) -> Criteria:
    """The standard criteria with one number halved or doubled, as the module's text says."""
    value = getattr(STANDARD, name)
    if name in ERRORS:
        new = 1.0 + factor * (value - 1.0)
    elif 0.5 <= value < 1.0:
        new = 1.0 - factor * (1.0 - value)
    else:
        new = type(value)(factor * value)
    return replace(STANDARD, **{name: new})


def variants() -> dict[str, Criteria]:
    """Label -> criteria: as they are, then one number at a time."""
    found = {"standard": STANDARD}
    for name in (field.name for field in fields(Criteria)):
        for word, factor in (("half", 0.5), ("double", 2.0)):
            found[f"{name} {word}"] = changed(name, factor)
    return found


def judged(draw: Path) -> dict[str, Any]:
    """What each variant answers on a draw, and what that is worth."""
    truth = json.loads((draw / "truth.json").read_text())
    search, asked, answers = opened(draw / "recording"), None, {}
    for label, criteria in variants().items():
        verdict, asked = search.answer(criteria, asked)
        found = score(truth, as_diagnosis(verdict), verdict.chosen.largest_error)
        answers[label] = asdict(found)
    return {"draw": draw.name, "answers": answers}


def as_diagnosis(verdict: Verdict) -> dict[str, Any]:
    """What scoring.py reads of diagnosis.json."""
    sets = [
        [(candidate.effect.name, joint) for candidate in one.effects for joint in candidate.joints]
        for one in (verdict.chosen, *verdict.rivals)
    ]
    named = [] if verdict.kind in ("adequate", "unknown_effect") else sets
    effects = [
        {
            "name": name,
            "joints": [joint],
            "rivals": [f"{n}@{j}" for m, one in enumerate(named) if m != k for n, j in one],
        }
        for k, one in enumerate(named)
        for name, joint in one
    ]
    return {"verdict": verdict.kind, "effects": effects}


def page(lines: list[dict[str, Any]], command: str) -> str:
    """The table."""
    rows = [
        "| number | value | right, acceptable, wrong (confidently) | answers that differ |",
        "|---|---|---|---|",
    ]
    for label, criteria in variants().items():
        name = label.split()[0]
        found = [line["answers"][label] for line in lines]
        differ = sum(line["answers"][label]["answer"] != line["answers"]["standard"]["answer"] for line in lines)
        counts = ", ".join(str(sum(one["outcome"] == o for one in found)) for o in ("right", "acceptable", "wrong"))
        confident = sum(one["confident"] for one in found)
        value = "" if label == "standard" else f"{getattr(STANDARD, name):g} -> {getattr(criteria, name):g}"
        rows.append(f"| {label} | {value} | {counts} ({confident}) | {differ} |")
    return "\n".join([f"`{command}`, {len(lines)} draws", "", *rows, ""])


def main() -> None:
    """All draws, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("round", type=Path, help="folder of a round that judge.py kept")
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--out", type=Path, default=Path("outputs/criteria"))
    given = parser.parse_args()
    finding.Together = RememberingTogether  # type: ignore[misc,attr-defined]
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / "answers.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.is_file() else []
    done = {line["draw"] for line in lines}
    command = f"python -m benchmarks.blind.criteria {given.round} --draws {given.draws}"
    for draw in sorted(given.round.glob("draw_*"))[: given.draws]:
        if draw.name not in done:
            lines.append(judged(draw))
            with path.open("a") as file:
                file.write(json.dumps(lines[-1]) + "\n")
            print(f"{draw.name}: {lines[-1]['answers']['standard']['answer']}", flush=True)
        (given.out / "criteria.md").write_text(page(lines, command))


if __name__ == "__main__":
    main()
