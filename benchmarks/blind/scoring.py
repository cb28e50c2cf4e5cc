"""Right, acceptable or wrong: what counts as a good answer to a blind recording.

| hidden | right | acceptable | wrong |
|---|---|---|---|
| nothing | `adequate` | | everything else (a false alarm) |
| one named effect | `missing_effect`, that name and joint | `ambiguous`, truth in the set; see below | the rest |
| two named effects | `missing_effect` with exactly both | `ambiguous`, both in the sets; see below | the rest |
| another form | `missing_effect`, its family alone, that joint | one in the set | the rest |
| one that has a twin there | `ambiguous`, truth and twin in the set | truth alone; one in the set | the rest |
| outside the catalogue | `unknown_effect` | `ambiguous`, `partly_explained` | the rest |

`partly_explained` counts as `ambiguous` does: it names what it found, and says that this is not all.

Forms are laws of the catalogue as other authors write them; the family of each, the catalogue's names that are right
for it, stands in forms.py, and so does what may be named beside it, because the form is a sum of both. `unknown_effect`
is wrong for them: a law of the catalogue says what the effect is.

Exceptions, each counted apart and never as right by name:
- `absorbed`: the plain model has a constant for it (Coulomb and viscous friction, stiffness, reflected inertia, joint
  offset), so `adequate` after refitting it is acceptable when the refitted model is at the floor on unseen trials.
- `said`: where there are two or three initialisations, an encoder's wrong zero cannot be told from their being alike by
  chance; `adequate` is acceptable when the answer says so, with that joint among its `common_offsets`.
- `invisible`: `adequate` for any other effect is acceptable when the recommended model is at the floor on unseen
  trials: the effect then changes nothing that this bench can measure.
- Effects of the whole mechanism (payload, coupling) may be named at any joint.
- A confidently wrong answer is `missing_effect` with other effects than the truth, wrong however small its error is, or
  `adequate` above the floor: either way nobody looks further.
"""

from dataclasses import dataclass
from typing import Any

CONFIDENT = ("missing_effect", "adequate")
"""Verdicts after which nobody looks further."""
AT_FLOOR = 1.2
"""Error on unseen trials, in units of the true sensor noise, below which nothing measurable is missing."""


@dataclass
class Score:
    """The judgement of one draw."""

    outcome: str
    """right, acceptable or wrong."""
    why: str
    truth: str
    answer: str
    confident: bool


def _label(names: list[tuple[str, list[str]]]) -> str:
    return " + ".join(f"{name}@{','.join(joints)}" for name, joints in sorted(names)) or "nothing"


def _matches(truth: dict[str, Any], name: str, joints: list[str], beside: bool = False) -> bool:
    names = [*truth.get("names", [truth["name"]]), *(truth.get("beside", []) if beside else [])]
    return name in names and (truth["any_joint"] or set(joints) == set(truth["joints"]))


def _merged(diagnosis: dict[str, Any]) -> list[dict[str, Any]]:
    """The answer's effects, one entry a name: the same effect at two joints is one effect at both."""
    merged: dict[str, dict[str, Any]] = {}
    for effect in diagnosis["effects"]:
        if effect["name"] in merged:
            merged[effect["name"]]["joints"] = merged[effect["name"]]["joints"] + list(effect["joints"])
        else:
            merged[effect["name"]] = {**effect, "joints": list(effect["joints"])}
    return list(merged.values())


def _in_set(truth: dict[str, Any], diagnosis: dict[str, Any]) -> bool:
    """Whether an ambiguous answer's set holds the truth; a rival is `name` (same joints) or `name@joint`."""
    for effect in diagnosis["effects"]:
        for candidate in [effect["name"], *effect.get("rivals", [])]:
            name, _, joints = str(candidate).partition("@")
            if _matches(truth, name, joints.split(",") if joints else list(effect["joints"])):
                return True
    merged = _merged(diagnosis)
    return any(_matches(truth, e["name"], e["joints"]) for e in merged)


def _named(truths: list[dict[str, Any]], diagnosis: dict[str, Any], at_floor: bool) -> tuple[str, str]:
    """Judge an answer where one or two catalogue effects are hidden."""
    verdict, answer = diagnosis["verdict"], _merged(diagnosis)
    found = [t for t in truths if any(_matches(t, e["name"], e["joints"]) for e in answer)]
    only = all(any(_matches(t, e["name"], e["joints"], beside=True) for t in truths) for e in answer)
    if verdict == "missing_effect":
        if only and len(found) == len(truths):
            return ("acceptable", "its twin unsaid") if any(t.get("twins") for t in truths) else ("right", "named")
        missed = [t for t in truths if t not in found]
        if only and found and at_floor:
            return "acceptable", "absorbed" if all(t["absorbed"] for t in missed) else "invisible"
        if not found:
            return "wrong", "another effect"
        return "wrong", "only one of two" if len(found) < len(truths) else "an effect too many"
    if verdict in ("ambiguous", "partly_explained"):
        if not all(_in_set(t, diagnosis) for t in truths):
            return "wrong", "not in the set"
        twins = [{**t, "name": t["twins"][0], "names": t["twins"]} for t in truths if t.get("twins")]
        together = verdict == "ambiguous" and twins and all(_in_set(t, diagnosis) for t in twins)
        return ("right", "named with its twin") if together else ("acceptable", "in the set")
    if verdict == "adequate":
        offsets = {one["joint"] for one in diagnosis.get("common_offsets", [])}
        if all(t["name"] == "position_offset" and set(t["joints"]) <= offsets for t in truths):
            return "acceptable", "said"
        if not at_floor:
            return "wrong", "missed"
        return "acceptable", "absorbed" if all(t["absorbed"] for t in truths) else "invisible"
    return "wrong", "called unknown"


def pushes_found(pushes: list[dict[str, Any]], diagnosis: dict[str, Any]) -> tuple[int, int, int]:
    """How many pushes there were, how many of them were left out, and how many stretches were left out besides."""
    left_out = diagnosis.get("left_out", [])

    def same(push: dict[str, Any], one: dict[str, Any]) -> bool:
        end = push["start"] + push["seconds"]
        return bool(one["trial"] == push["trial"] and one["start"] < end and push["start"] < one["end"])

    found = sum(any(same(push, one) for one in left_out) for push in pushes)
    return len(pushes), found, sum(not any(same(push, one) for push in pushes) for one in left_out)


def score(truth: dict[str, Any], diagnosis: dict[str, Any], ratio: float | None) -> Score:
    """Judge a diagnosis; `ratio` is the recommended model's error on unseen trials over the sensor noise."""
    verdict, effects = diagnosis["verdict"], truth["effects"]
    at_floor = ratio is not None and ratio <= AT_FLOOR
    if not effects:
        outcome, why = ("right", "nothing hidden") if verdict == "adequate" else ("wrong", "false alarm")
    elif all(e["in_catalogue"] for e in effects):
        outcome, why = _named(effects, diagnosis, at_floor)
    elif verdict == "unknown_effect":
        outcome, why = "right", "unknown"
    elif verdict in ("ambiguous", "partly_explained"):
        outcome, why = "acceptable", "not sure" if verdict == "ambiguous" else "a part by another effect"
    elif verdict == "adequate" and at_floor:
        outcome, why = "acceptable", "invisible"
    else:
        outcome, why = "wrong", "missed" if verdict == "adequate" else "explained by another effect"
    told = _label([(e["name"], e["joints"]) for e in _merged(diagnosis)])
    answer = verdict if verdict in ("adequate", "unknown_effect") else f"{verdict}: {told}"
    hidden = _label([(e["name"], e["joints"]) for e in effects])
    return Score(outcome, why, hidden, answer, outcome == "wrong" and verdict in CONFIDENT)
