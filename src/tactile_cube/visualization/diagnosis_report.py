"""The report of `diagnose` and `identify`: what is missing, how sure, how far the error falls, what to record next."""

from collections.abc import Mapping, Sequence
from typing import Any

from tactile_cube.identification.in_words import (
    PARTIAL,
    UNPROVEN,
    UNRELATED,
    common_offset,
    disturbed,
    headline,
    left_over,
    sets_in_words,
    unproven_effects,
    unseen_effects,
)
from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Shape
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import common_unit, milli, of_joint, short
from tactile_cube.visualization.comparison_report import (
    band_section,
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
from tactile_cube.visualization.report import Listing, Report, Section, Tile, Tone

VERDICTS: dict[str, tuple[Tone, str]] = {
    "adequate": ("good", "Nothing is missing: the model is as good as this recording can tell."),
    "missing_effect": ("good", "The missing effect was found"),
    "ambiguous": ("warn", "Several effects explain this recording equally well"),
    "partly_explained": ("warn", "Most of what is missing was found, but not all of it"),
    "unknown_effect": ("warn", "Something is missing that no effect of the catalogue explains."),
}


def diagnosis_report(
    diagnosis: Mapping[str, Any],
    before: Comparison,
    after: Comparison | None,
    command: str,
    model_path: str | None = None,
    shapes: Sequence[Shape] = (),
    experiment: Experiment | None = None,
) -> Report:
    """The page of a diagnosis.

    Args:
        diagnosis: the content of diagnosis.json.
        before: the model as it was, beside the recording.
        after: the recommended model beside the recording; None if it is the same.
        command: the command line that made it.
        model_path: the recommended model's file.
        shapes: shape of what stays unexplained.
        experiment: what would tell the rivals apart.
    """
    tone, said = VERDICTS[diagnosis["verdict"]]
    if diagnosis.get("unproven_effects") and diagnosis["verdict"] == "unknown_effect":
        said = UNPROVEN
    elif headline(diagnosis) in (PARTIAL, UNRELATED):
        said = headline(diagnosis)
    units = before.recording.units
    sets = diagnosis.get("sets", [])
    names = (
        sets_in_words(sets)
        if sets
        else " and ".join(f"{effect['name']} at {', '.join(effect['joints'])}" for effect in diagnosis["effects"])
    )
    sections = [
        _verdict_section(diagnosis, units),
        stage_section(diagnosis["error"], diagnosis.get("error_joints", {}), units=units),
        *([held_section(diagnosis["contact"])] if "contact" in diagnosis else []),
        *effect_section(diagnosis["effects"], units),
        *shape_section(shapes, units),
        *ranking_section(diagnosis["ranking"]),
        next_section(diagnosis, model_path, before, experiment),
        recording_section(before.recording, before.model),
        where_section(before, "Where the stated model fails"),
        overlay_section(before)
        if after is None
        else overlay_section(after, "Measured and simulated, before and after what was found", before),
        *([] if after is None else [test_section(after)]),
    ]
    return Report(
        title=f"What is missing? {before.recording.name}",
        answer=f"{said}: {names}{left_over(diagnosis)}." if names else said,
        tone=tone,
        tiles=_tiles(diagnosis, common_unit(units.values())),
        sections=sections,
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
            *band_section(after),
            test_section(after),
            train_section(model_path),
        ],
        footer=f"Made by tactile_cube: {command}",
    )


def _verdict_section(diagnosis: Mapping[str, Any], units: Mapping[str, str]) -> Section:
    lines = [_in_a_line(effect, units) for effect in diagnosis["effects"]]
    if known := diagnosis.get("known_effects"):
        lines.append(f"beside what was known: {', '.join(known)}")
    partial = diagnosis.get("partial_effects", [])
    lines += [f"reduces the error, but more is missing: {_in_a_line(one, units)}" for one in partial]
    if unproven := diagnosis.get("unproven_effects"):
        lines += unproven_effects(unproven)
    lines += [common_offset(entry, units) for entry in diagnosis.get("common_offsets", [])]
    lines += disturbed(diagnosis)
    for joint in diagnosis["unexplained_joints"]:
        lines.append(f"not explained: {joint}{_ceiling(diagnosis, joint)}")
    return Section("The answer", (), [Listing([*(lines or ["no effect has to be added"]), *unseen_effects(diagnosis)])])


def _in_a_line(effect: Mapping[str, Any], units: Mapping[str, str]) -> str:
    own = common_unit(units[joint] for joint in effect["joints"] if joint in units)
    values = [f"{name} {short(p['value'])} {of_joint(p['unit'], own)}" for name, p in effect["parameters"].items()]
    return f"{effect['name']} at {', '.join(effect['joints'])}: {', '.join(values)}"


def _ceiling(diagnosis: Mapping[str, Any], joint: str) -> str:
    """How much there is to be found at all."""
    shares = [one["black_box"] for one in diagnosis.get("unexplained", []) if one["joint"] == joint]
    if not shares:
        return ""
    return (
        "; a black-box model of position, velocity, torque, neighbours and time could still explain "
        f"{100 * shares[0]:.0f} % of the missing torque"
    )


def _tiles(diagnosis: Mapping[str, Any], unit: str) -> list[Tile]:
    errors = diagnosis["error"]
    tiles = [Tile(diagnosis["verdict"].replace("_", " "), "verdict", VERDICTS[diagnosis["verdict"]][0])]
    guessed = diagnosis.get("noise_floor_source") == "guess"
    part = "test" if diagnosis.get("tested") else "held-out"
    for key, label in (
        ("nominal", f"{part} error as stated"),
        ("with_effects", f"{part} error with the recommended model"),
        (
            "noise_floor",
            "noise floor (sensor noise, a guess: no repeats)" if guessed else "noise floor (scatter of repeats)",
        ),
    ):
        if errors.get(key) is not None:
            tiles.append(Tile(milli(errors[key], unit), label))
    return tiles
