"""The page about fingertips and object: what was found, how the error falls, what each trial says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactile_cube.identification.contact_identification import ContactIdentification
from tactile_cube.visualization.diagnosis_report import VERDICTS
from tactile_cube.visualization.diagnosis_sections import effect_section, ranking_section, staircase_section
from tactile_cube.visualization.numbers import mrad
from tactile_cube.visualization.report import Listing, Report, Section, Table

EXPLANATION = (
    "The hand holds a known load and loosens its grip until the load slips. Each trial was simulated in the world that "
    "training uses, with the joint offsets and the place of the load that suit it; a trial's value is the one with "
    "which the simulated load slips when the real one did."
)


def contact_sections(found: ContactIdentification) -> list[Section]:
    """What was found of fingertips and object."""
    effects = [{"name": one.effect, "joints": ["object"], "parameters": one.parameters} for one in found.effects()]
    rows = [
        (effect, one.trial, str(one.initialisation), f"{one.value:.4g}", "" if one.telling else "does not show it")
        for (effect, _), said in found.fit.opinions.items()
        for one in said
    ]
    table = Table(("effect", "trial", "initialisation", "value", ""), rows)
    stages = {key: one.overall for key, one in found.stages.items()} | {"noise_floor": found.noise_floor}
    joints = {key: one.joints for key, one in found.stages.items()}
    return [
        staircase_section(stages, joints),
        *effect_section(effects),
        Section("What each trial says", (EXPLANATION,), [table]),
    ]


def contact_diagnosis_report(result: Mapping[str, Any], name: str, command: str) -> Report:
    """The page of a diagnosis of fingertips and object alone, from the content of diagnosis.json."""
    tone, said = VERDICTS[result["verdict"]]
    names = (" or " if result["verdict"] == "ambiguous" else " and ").join(one["name"] for one in result["effects"])
    return Report(
        title=f"What is missing? {name}",
        answer=f"{said}: {names}." if names else said,
        tone=tone,
        sections=[
            staircase_section(result["error"], result["error_joints"]),
            *effect_section(result["effects"]),
            *ranking_section(result["ranking"]),
        ],
        footer=f"Made by tactile_cube in {result['seconds']:.0f} s: {command}",
    )


def contact_report(found: ContactIdentification, name: str, command: str, model_path: str) -> Report:
    """The page of an identification of contact effects alone."""
    before, after = found.stages["nominal"].overall, found.stages["with_effects"].overall
    train = Listing([f"python -m tactile_cube.train +experiment=finetune model={model_path}"], code=True)
    follow = Section(
        "What to do next", ["Train with what was found; the intervals become randomisation ranges:"], [train]
    )
    return Report(
        title=f"Identified: {name}",
        answer=f"The error on trials that the fit never saw fell from {mrad(before)} to {mrad(after)}.",
        tone="plain" if found.fit.silent() else "good",
        sections=[*contact_sections(found), follow],
        footer=f"Made by tactile_cube: {command}",
    )
