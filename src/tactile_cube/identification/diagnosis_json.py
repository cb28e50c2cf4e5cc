"""diagnosis.json: the diagnosis as plain numbers, for scripts."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tactile_cube.drivetrain.model_file import EffectEstimate
from tactile_cube.identification.diagnosis import Diagnosis
from tactile_cube.identification.fitting.intervals import Fitted, bounds
from tactile_cube.identification.model_files import effect_estimate
from tactile_cube.identification.next_experiment import FILE, Experiment
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.identification.verdict import unexplained_joints
from tactile_cube.measurement.replay.model import effect_path

RANKED = 20


def as_json(diagnosis: Diagnosis, seconds: float) -> dict[str, Any]:
    """The content of diagnosis.json; errors in rad."""
    verdict, experiment = diagnosis.verdict, diagnosis.experiment
    explanations = [(verdict.chosen, diagnosis.fitted), *diagnosis.rivals]
    names = [_names(one) for one, _ in explanations]
    effects = [
        entry
        for k, (one, fitted) in enumerate(explanations)
        for entry in _effects(one, fitted, [n for m, other in enumerate(names) if m != k for n in other])
    ]
    errors = diagnosis.errors().model_dump()
    joints = list(diagnosis.stages["nominal"].joints)
    return {
        "verdict": verdict.kind,
        "effects": effects if verdict.kind not in ("adequate", "unknown_effect") else [],
        "sets": [list(dict.fromkeys(one)) for one in names] if diagnosis.rivals else [],
        "unexplained_joints": unexplained_joints(verdict.chosen, tuple(joints)),
        "ranking": ranking(diagnosis),
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
        "unproven_effects": _unproven(diagnosis),
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
    }


def safety_as_json(experiment: Experiment) -> dict[str, Any]:
    """What the proposed command, or the one nearest to the limits, does at most, and what it may do."""
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


def ranking(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """What was weighed: refitted explanations with held-out errors, then first-order scores."""
    rows: list[dict[str, Any]] = [
        {
            "effects": " & ".join(_names(one)),
            "held_out_error_over_noise": round(one.error, 4),
            "gain": round(one.gain, 5),
            "p_value": one.p_value,
        }
        for one in diagnosis.findings.proven(diagnosis.criteria)
    ]
    judged = {row["effects"] for row in rows}
    for score in diagnosis.findings.scores[:RANKED]:
        name = " & ".join(_label(score.candidate))
        if name not in judged:
            judged.add(name)
            rows.append({"effects": name, "held_out_error_over_noise": None, "gain": None, "p_value": None})
    return rows


def _unproven(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "effects": _names(one),
            "heldout_gain": round(one.gain, 6),
            "p_value": one.p_value,
            "segments": int((one.judgement.samples > 0).sum()),
        }
        for one in diagnosis.unproven
    ]


def _label(candidate: Candidate) -> list[str]:
    return [f"{effect_path(candidate.effect)}@{joint}" for joint in candidate.joints]


def _names(explanation: Explanation) -> list[str]:
    return [name for candidate in explanation.effects for name in _label(candidate)]


def _effects(explanation: Explanation, fitted: Fitted, rivals: list[str]) -> list[dict[str, Any]]:
    known = bounds(fitted)
    entries = []
    first = len(fitted.model.terms) - explanation.terms
    for place, term in enumerate(fitted.model.terms[first:], start=first):
        estimate: EffectEstimate = effect_estimate(term, place, known)
        entries.append(
            {
                "name": effect_path(term.effect),
                "joints": [term.joint],
                "parameters": {key: estimate.parameters[key].model_dump() for key in term.fitted},
                "heldout_gain": round(explanation.gain, 6),
                "p_value": explanation.p_value,
                "rivals": [name for name in rivals if name != term.label],
            }
        )
    return entries


def _unexplained(one: Any) -> dict[str, Any]:
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
