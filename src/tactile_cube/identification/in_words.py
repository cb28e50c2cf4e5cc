"""The diagnosis in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.next_experiment import Experiment

OPENING = {
    "adequate": "Nothing is missing at this noise: with its constants refitted the model explains the recording.",
    "missing_effect": "An effect is missing, and it is this one:",
    "ambiguous": "An effect is missing, but this recording cannot tell these apart:",
    "unknown_effect": "Something is missing that no effect of the catalogue explains.",
}
UNPROVEN = "Something is missing, and these trials do not suffice to prove what."
GAIN_OF = {"error": "the held-out error", "offsets": "the joint offsets that the grips need"}
HELD = "Nothing is missing that these grasps show: the world follows them about as well as one with the true effects."


def answer(result: dict[str, Any], experiment: Experiment | None) -> str:
    """A few lines for the terminal, from the content of diagnosis.json."""
    grasps = result.get("noise_floor_source") == "contact"
    unproven = result.get("unproven_effects")
    opening = UNPROVEN if unproven else OPENING[result["verdict"]]
    lines = [HELD if grasps and result["verdict"] == "adequate" else opening]
    lines += [_effect(entry) for entry in result["effects"]]
    if known := result.get("known_effects"):
        lines.append(f"  beside what was known: {', '.join(known)}")
    if partial := result.get("partial_effects"):
        lines.append("  These help, and the recommended model holds them, but they are not the whole of it:")
        lines += [_effect(entry) for entry in partial]
    lines += [f"  {line}" for line in unproven_effects(unproven)] if unproven else []
    lines += [_unexplained(entry) for entry in result["unexplained"]]
    lines += [f"  {common_offset(entry)}" for entry in result.get("common_offsets", [])]
    error = result["error"]
    refitted = f"{_mrad(error['refitted'])} with constants refitted, " if not grasps else ""
    lines.append(
        f"Held-out error: {_mrad(error['nominal'])} as stated, {refitted}"
        f"{_mrad(error['with_effects'])} with the recommended model; noise floor {_mrad(error['noise_floor'])}."
    )
    if experiment is not None:
        lines.append(f"To decide, play {result['next_experiment']}: {expected(experiment)}")
    return "\n".join(lines)


def expected(experiment: Experiment) -> str:
    """What the next experiment is expected to show."""
    names = ", ".join(experiment.predictions)
    return (
        f"{experiment.name} of {experiment.time[-1]:.0f} s; at {experiment.joint} any two of {names} will differ by at "
        f"least {_mrad(experiment.difference)}."
    )


def _effect(entry: dict[str, Any]) -> str:
    values = ", ".join(
        f"{name} {one['value']:.4g} [{one['low']:.4g}, {one['high']:.4g}] {one['unit']}"
        for name, one in entry["parameters"].items()
    )
    return f"  {entry['name']} at {', '.join(entry['joints'])}: {values}"


def _unexplained(entry: dict[str, Any]) -> str:
    return (
        f"  {entry['joint']}: the torque that {entry['beside']} lacks goes most with "
        f"{entry['depends_most_on']}; beside the recommended model a black box could explain "
        f"{100 * entry['black_box']:.0f} % of it"
    )


def unproven_effects(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Effects of which one may be the missing one, and what to do about it."""
    lines = [
        f"{' & '.join(one['effects'])} would take {100 * one['heldout_gain']:.0f} % of the held-out squared error away "
        f"(p {one['p_value']:.2g})"
        for one in entries
    ]
    return [
        *lines,
        f"{entries[0]['segments']} held-out segments do not tell that from chance: record more trials, or longer ones.",
    ]


def common_offset(entry: Mapping[str, Any]) -> str:
    """A joint offset that all initialisations have, and what would tell where it comes from."""
    return (
        f"{entry['joint']} reads about {_mrad(entry['offset'])} too much in each of {entry['initialisations']} "
        "initialisations: by chance, or its encoder's zero is wrong (position_offset); more initialisations will tell."
    )


def _mrad(value: float) -> str:
    return f"{1e3 * value:.3g} mrad"


def staircase(stages: Mapping[str, float], model: ModelFile) -> str:
    """How the held-out error fell, and the values of the effects that were fitted."""
    lines = ["Held-out error, free-running simulation:"]
    lines += [f"  {stage.replace('_', ' '):<40} {_mrad(value)}" for stage, value in stages.items()]
    for effect in model.effects:
        fitted = {name: one for name, one in effect.parameters.items() if one.high > one.low}
        values = ", ".join(f"{n} {e.value:.4g} [{e.low:.4g}, {e.high:.4g}] {e.unit}" for n, e in fitted.items())
        lines.append(f"{effect.effect}: {values}")
    return "\n".join(lines)
