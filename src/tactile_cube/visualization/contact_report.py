"""The page about fingertips and object: what was found, how the error falls, what each trial says."""

from __future__ import annotations

from typing import Any

from tactile_cube.identification.contact.identification import ContactIdentification
from tactile_cube.identification.in_words import GAIN_OF, answer
from tactile_cube.measurement.units import milli
from tactile_cube.visualization.diagnosis_report import tone_of
from tactile_cube.visualization.diagnosis_sections import (
    HELD,
    effect_section,
    held_section,
    ranking_section,
    stage_section,
    train_section,
)
from tactile_cube.visualization.report import Listing, Report, Section, Table

EXPLANATION = (
    "The hand holds a known load and loosens its grip until the load slips. Each trial was simulated in the world that "
    "training uses, with the joint offsets and the place of the load that suit it. An initialisation's value is the "
    "one with which its trials are followed best: the simulated load slips when the real one did. The scatter of "
    "these values makes the interval."
)


def contact_sections(found: ContactIdentification, alone: bool = True) -> list[Section]:
    """What was found of fingertips and object; values only if they stand `alone`, not beside those of the drives."""
    effects = [{"name": one.effect, "joints": ["object"], "parameters": one.parameters} for one in found.effects()]
    rows = [
        (effect, parameter, str(one.initialisation), f"{one.value:.4g}", "" if one.telling else "does not show it")
        for (effect, parameter), said in found.fit.by_initialisation.items()
        for one in said
    ]
    table = Table(("effect", "parameter", "initialisation", "value", ""), rows)
    stages = {key: one.overall for key, one in found.stages.items()} | {"noise_floor": found.noise_floor}
    joints = {key: one.joints for key, one in found.stages.items()}
    by_initialisation = Section("What each initialisation says", [EXPLANATION], [table])
    return [stage_section(stages, joints, HELD), *(effect_section(effects) if alone else []), by_initialisation]


def contact_diagnosis_report(
    result: dict[str, Any], name: str, command: str, recording: str, model_path: str
) -> Report:
    """The page of a diagnosis of fingertips and object alone, from the content of diagnosis.json."""
    ranking = [
        {
            "effect": row["effects"],
            "held-out error [mrad]": 1e3 * row["held_out_error"],
            "share that it takes off": row["gain"],
            "of": GAIN_OF[row["gain_of"]],
            "p (no better than without)": row["p_value"],
        }
        for row in result["ranking"]
    ]
    effects = ",".join(one["name"] for one in result["effects"])
    train = f"python -m tactile_cube.train +experiment=adapt model={model_path}"
    fit = f"python -m tactile_cube.identify recording={recording} effects=[{effects}]"
    said, lines = {
        "adequate": ("Train in the world as it is stated:", [train]),
        "missing_effect": ("Fit exactly this on all trials, and train with the result:", [fit, train]),
        "ambiguous": ("Record more loads and initialisations and diagnose again, or see what each would be:", [fit]),
        "unknown_effect": ("Record free motion too: the drivetrain may lack something that the grasps show.", []),
    }[result["verdict"]]
    return Report(
        title=f"What is missing? {name}",
        answer=answer(result, None),
        tone=tone_of(result),
        sections=[
            held_section(result),
            *effect_section(result["effects"]),
            *ranking_section(ranking),
            Section("What to do next", [said], [Listing(lines, code=True)] if lines else []),
        ],
        footer=f"Made by tactile_cube in {result['seconds']:.0f} s: {command}",
    )


def contact_report(found: ContactIdentification, name: str, command: str, model_path: str) -> Report:
    """The page of an identification of contact effects alone."""
    before, after = found.stages["nominal"].overall, found.stages["with_effects"].overall
    return Report(
        title=f"Identified: {name}",
        answer=f"The error on trials that the fit never saw fell from {milli(before)} to {milli(after)}.",
        tone="plain" if found.fit.silent() else "good",
        sections=[*contact_sections(found), train_section(model_path)],
        footer=f"Made by tactile_cube: {command}",
    )
