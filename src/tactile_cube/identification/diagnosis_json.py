"""diagnosis.json: the diagnosis as plain numbers, for scripts."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.diagnosis import Diagnosis
from tactile_cube.identification.fitting.resolution import Fitted, bounds
from tactile_cube.identification.model_files import effect_estimate
from tactile_cube.identification.next_experiment import FILE, Experiment
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.search.findings import Findings
from tactile_cube.identification.verdict import Unexplained, unexplained_joints
from tactile_cube.measurement.replay.model import effect_label, effect_path

RANKED = 20


def as_json(diagnosis: Diagnosis, seconds: float, units: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of diagnosis.json, with errors in the `units` of the joints' positions."""
    verdict, experiment = diagnosis.verdict, diagnosis.experiment
    explanations = [(verdict.chosen, diagnosis.fitted), *diagnosis.rivals]
    effects = effect_entries(explanations, units)
    errors = diagnosis.errors().model_dump()
    joints = list(diagnosis.stages["nominal"].joints)
    return {
        "verdict": verdict.kind,
        "effects": effects if verdict.kind not in ("adequate", "unknown_effect") else [],
        "sets": [names_of(one) for one, _ in explanations] if diagnosis.rivals else [],
        "unexplained_joints": unexplained_joints(verdict.chosen, tuple(joints)),
        "ranking": ranking(diagnosis.findings, diagnosis.criteria),
        "error": {key: errors[key] for key in ("nominal", "refitted", "with_effects", "noise_floor")},
        "error_joints": errors["joints"],
        "noise_floor_source": diagnosis.floor.source,
        "drift": [asdict(one) for one in diagnosis.floor.drift],
        "standard_model": {
            "otherwise": list(diagnosis.standard.otherwise),
            "error": diagnosis.standard.error,
            "stated_error": diagnosis.standard.stated_error,
        },
        "error_part": "test" if diagnosis.tested else "held_out",
        "error_over_noise": diagnosis.over_noise,
        "unexplained": [_unexplained(one) for one in diagnosis.unexplained],
        "partial_effects": effects if verdict.kind == "unknown_effect" else [],
        "unproven_effects": [
            {
                "effects": names_of(one),
                "heldout_gain": round(one.gain, 6),
                "p_value": one.p_value,
                "segments": int((one.judgement.samples > 0).sum()),
            }
            for one in diagnosis.unproven
        ],
        "known_effects": list(diagnosis.known),
        "common_offsets": [asdict(one) for one in diagnosis.common],
        "left_out": [asdict(one) for one in diagnosis.left_out],
        "suspected": [asdict(one) for one in diagnosis.suspected],
        "unseen": [one._asdict() for one in diagnosis.unseen],
        "next_experiment": FILE if experiment and experiment.decides else None,
        "next_experiment_safety": safety_as_json(experiment) if experiment else None,
        "inseparable": [list(pair) for pair in experiment.inseparable] if experiment else [],
        "held_out": diagnosis.held_out,
        "tested": diagnosis.tested,
        "stopped_early": diagnosis.findings.stopped,
        "seconds": round(seconds, 2),
        "units": dict(units),
    }


def safety_as_json(experiment: Experiment) -> dict[str, Any]:
    """Return the largest values of the proposed command, or of the one nearest to the limits, and their bounds."""
    safety = experiment.safety
    envelopes = {"reached": safety.reached, "stop_beyond": safety.allowed, "limit": safety.limits.largest}
    return {
        "safe": safety.safe,
        "kind": experiment.name,
        "scale": safety.scale,
        "seconds": float(experiment.time[-1]),
        "open_loop": safety.open_loop,
        "margin": safety.margin,
        "models": safety.models,
        "starts": len(safety.starts),
        "joints": {
            joint: {
                "start": float(safety.starts[-1, j]),
                **{key: one.of_joint(j) for key, one in envelopes.items()},
                "stated_by": {key: by[j] for key, by in safety.limits.sources.items()},
            }
            for j, joint in enumerate(experiment.joints)
        },
    }


def ranking(findings: Findings, criteria: Criteria) -> list[dict[str, Any]]:
    """Return the refitted explanations with held-out errors, then the best candidates of the screening."""
    rows: dict[str, dict[str, Any]] = {}
    for one in findings.proven(criteria):
        numbers = {"gain": round(one.gain, 5), "p_value": one.p_value}
        name = " & ".join(names_of(one))
        rows.setdefault(name, {"effects": name, "held_out_error_over_noise": round(one.error, 4)} | numbers)
    nothing = dict.fromkeys(("held_out_error_over_noise", "gain", "p_value"))
    for score in findings.scores[:RANKED]:
        name = " & ".join(_label(score.candidate))
        rows.setdefault(name, {"effects": name} | nothing)
    return list(rows.values())


def _label(candidate: Candidate) -> list[str]:
    return [effect_label(candidate.effect, joint) for joint in candidate.joints]


def names_of(explanation: Explanation) -> list[str]:
    """Return NAME@JOINT of each effect."""
    return list(dict.fromkeys(name for candidate in explanation.effects for name in _label(candidate)))


def effect_entries(
    explanations: Sequence[tuple[Explanation, Fitted]], units: Mapping[str, str] | None = None
) -> list[dict[str, Any]]:
    """Return the effects of the chosen explanation and its rivals, each with those it is not separable from."""
    entries = []
    for one, fitted in explanations:
        known, first = bounds(fitted), len(fitted.model.terms) - one.terms
        rivals = [name for other, _ in explanations if other is not one for name in names_of(other)]
        for place, term in enumerate(fitted.model.terms[first:], start=first):
            estimate = effect_estimate(term, place, known, units)
            entries.append(
                {
                    "name": effect_path(term.effect),
                    "joints": [term.joint],
                    "parameters": {key: estimate.parameters[key].model_dump() for key in term.fitted},
                    "heldout_gain": round(one.gain, 6),
                    "p_value": one.p_value,
                    "rivals": [name for name in rivals if name != term.label],
                }
            )
    return entries


def _unexplained(one: Unexplained) -> dict[str, Any]:
    best = one.shapes[0] if one.shapes else None
    return {
        "joint": one.joint,
        "black_box": round(one.black_box, 4),
        "explained": round(one.explained, 4),
        "of_explainable": round(one.of_explainable, 4),
        "beside": best.beside if best else None,
        "depends_most_on": best.against if best else None,
        "shapes": [
            {
                "against": shape.against,
                "explained": round(shape.explained, 4),
                "centres": [round(float(x), 6) for x in shape.centres],
                "torque": [round(float(x), 7) for x in shape.mean],
            }
            for shape in one.shapes
        ],
    }
