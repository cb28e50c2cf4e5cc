"""The reports of `diagnose` and `identify`: what is missing, how sure, how far the error falls, what to record next."""

from collections.abc import Mapping, Sequence
from typing import Any

from tactile_cube.identification.contact.identification import ContactIdentification
from tactile_cube.identification.in_words import answer
from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Shape
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.units import common_unit, milli
from tactile_cube.visualization.comparison_report import (
    overlay_section,
    recording_section,
    test_section,
    where_section,
)
from tactile_cube.visualization.diagnosis_sections import (
    effect_section,
    held_section,
    next_section,
    ranking_section,
    shape_section,
    stage_section,
    train_section,
    value_section,
)
from tactile_cube.visualization.report import Report, Section, Tone


def _tone(diagnosis: Mapping[str, Any]) -> Tone:
    """Whether a diagnosis leaves nothing open."""
    return "good" if diagnosis["verdict"] in ("adequate", "missing_effect") else "warn"


def diagnosis_report(
    diagnosis: dict[str, Any],
    before: Comparison,
    after: Comparison,
    command: str,
    model_path: str,
    shapes: Sequence[Shape] = (),
    experiment: Experiment | None = None,
) -> Report:
    """The page of a diagnosis.

    Args:
        diagnosis: the content of diagnosis.json.
        before: the model as it was, beside the recording.
        after: the recommended model beside the recording.
        command: the command line that made it.
        model_path: the recommended model's file.
        shapes: shape of what stays unexplained.
        experiment: what would tell the rivals apart.
    """
    units = before.recording.units
    return Report(
        title=f"What is missing? {before.recording.name}",
        answer=answer(diagnosis, None),
        tone=_tone(diagnosis),
        sections=[
            stage_section(diagnosis["error"], diagnosis.get("error_joints", {}), units=units),
            *(held_section(one["error"], one["error_joints"]) for one in [diagnosis.get("contact")] if one),
            *effect_section(diagnosis["effects"], units),
            *shape_section(shapes, units),
            *ranking_section(diagnosis["ranking"]),
            next_section(diagnosis, model_path, before.recording, experiment),
            recording_section(before.recording, before.model),
            where_section(before, "Where the stated model fails"),
            overlay_section(after, "Measured and simulated, before and after what was found", before),
            test_section(after),
        ],
        footer=f"Made by tactile_cube in {diagnosis['seconds']:.0f} s: {command}",
    )


def identification_report(
    after: Comparison,
    stages: Mapping[str, float | None],
    joints: Mapping[str, Mapping[str, float]],
    command: str,
    model_path: str,
    further: Sequence[Section] = (),
) -> Report:
    """The page of an identification: the error of each stage, the values found, the fitted model beside the recording.

    Args:
        after: the fitted model beside the recording.
        stages: name of a stage -> held-out error [rad], in order, and `noise_floor`.
        joints: the same stage -> joint -> error [rad].
        command: the command line that made it.
        model_path: the model file that was written.
        further: what trials with an object say.
    """
    steps = [value for key, value in stages.items() if key != "noise_floor" and value is not None]
    effects = after.model.effects if after.model is not None else []
    found = [{"name": e.name, "joints": [e.joint or "object"], "parameters": e.parameters} for e in effects]
    units = after.recording.units
    unit = common_unit(units.values())
    return Report(
        title=f"Identified: {after.recording.name}",
        answer=f"The error on trials that the fit never saw fell from {milli(steps[0], unit)} to "
        f"{milli(steps[-1], unit)}; {milli(stages['noise_floor'] or after.floor.overall, unit)} would be noise alone.",
        tone="good",
        sections=[
            stage_section(stages, joints, units=units),
            *effect_section(found, units),
            *further,
            value_section(after),
            recording_section(after.recording, after.model),
            where_section(after),
            overlay_section(after),
            test_section(after),
            train_section(model_path),
        ],
        footer=f"Made by tactile_cube: {command}",
    )


def contact_diagnosis_report(result: dict[str, Any], recording: Recording, command: str, model_path: str) -> Report:
    """The page of a diagnosis of fingertips and object alone, from the content of diagnosis.json."""
    return Report(
        title=f"What is missing? {recording.name}",
        answer=answer(result, None),
        tone=_tone(result),
        sections=[
            held_section(result["error"], result["error_joints"]),
            *effect_section(result["effects"]),
            *ranking_section(result["ranking"]),
            next_section(result, model_path, recording, None),
        ],
        footer=f"Made by tactile_cube in {result['seconds']:.0f} s: {command}",
    )


def contact_report(found: ContactIdentification, name: str, command: str, model_path: str) -> Report:
    """The page of an identification of contact effects alone."""
    effects = [{"name": one.effect, "joints": ["object"], "parameters": one.parameters} for one in found.effects()]
    return Report(
        title=f"Identified: {name}",
        answer=f"The error on trials that the fit never saw fell from {milli(found.errors['nominal'])} to "
        f"{milli(found.errors['with_effects'])}.",
        tone="plain" if found.silent else "good",
        sections=[held_section(found.errors, found.joint_errors), *effect_section(effects), train_section(model_path)],
        footer=f"Made by tactile_cube: {command}",
    )
