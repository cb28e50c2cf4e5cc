"""The diagnosis and the next experiment in plain words."""

from collections.abc import Mapping, Sequence
from typing import Any

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.identification.next_experiment import FILE, Experiment
from tactile_cube.identification.safe_commands import QUANTITIES, SCALES, TRIALS
from tactile_cube.measurement.comparing.noise_floor import Drift
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.units import TURNS, common_unit, milli, named, of_joint, short

OPENING = {
    "adequate": "Nothing is missing at this noise: with its constants refitted the model explains the recording.",
    "missing_effect": "An effect is missing, and it is this one:",
    "ambiguous": "An effect is missing, but this recording cannot tell these apart:",
    "partly_explained": "Most of what is missing was found, but not all of it. Found:",
    "unknown_effect": "Something is missing that no effect of the catalogue explains.",
}
SEVERAL = "Effects are missing, and they are these:"
UNRELATED = "The error is above the noise, but it follows none of the logged signals."
NO_LAW, LEFT = 0.05, 2.0  # share that a black box explains of what follows no law; noise floors worth a word
FAR = 0.2  # part of a stated constant by which a fitted one may differ without a word
PARTIAL = "Some effects reduce the error, but more is missing."
UNPROVEN = "Something is missing, but these trials are too few to prove what."
HELD = "Nothing is missing that these grasps show: the world follows them about as well as one with the true effects."


def answer(result: dict[str, Any], experiment: Experiment | None, constants: Sequence[str] = ()) -> str:
    """Return the content of diagnosis.json as lines for the terminal; `constants`: those unlike their stated values."""
    units = result.get("shown_in", result.get("units", {}))
    grasps, unproven = result.get("noise_floor_source") == "contact", result.get("unproven_effects")
    opening = headline(result)
    if unproven and result["verdict"] == "unknown_effect":
        opening = UNPROVEN
    elif grasps and result["verdict"] == "adequate":
        opening = HELD
    lines = [f"{opening}{left_over(result)}"]
    lines += [_effect(entry, units) for entry in result["effects"]]
    lines += [f"  That is either {sets_in_words(result['sets'])}."] if result.get("sets") else []
    if known := result.get("known_effects"):
        lines.append(f"  beside what was known: {', '.join(known)}")
    if partial := result.get("partial_effects"):
        lines.append("  The recommended model contains them:")
        lines += [_effect(entry, units) for entry in partial]
    lines += [f"  {line}" for line in unproven_effects(unproven)] if unproven else []
    lines += [_unexplained(entry, units) for entry in result["unexplained"]]
    lines += [f"  {common_offset(entry, units)}" for entry in result.get("common_offsets", [])]
    lines += [f"  {line}" for line in (*disturbed(result), *unseen_effects(result))]
    lines += [f"  {Drift(**one).sentence(units.get(one['joint'], TURNS))}." for one in result.get("drift", [])]
    if left := result.get("stopped_early"):
        lines.append(f"The search stopped early (criteria.most_simulated); next: {left}.")
    lines += [f"Constants found otherwise than stated: {', '.join(constants)}."] if constants else []
    error, unit = result["error"], common_unit(units.values())
    refitted = f"{milli(error['refitted'], unit)} with constants refitted, " if not grasps else ""
    lines.append(
        f"{error_of(result)}: {milli(error['nominal'], unit)} as stated, {refitted}"
        f"{milli(error['with_effects'], unit)} with the recommended model; "
        f"noise floor {milli(error['noise_floor'], unit)}."
    )
    if over := result.get("error_over_noise"):
        lines.append(
            f"Error over sensor noise in short windows: {over['refitted']:.2f} with constants refitted, "
            f"{over['with_effects']:.2f} with the recommended model."
        )
    if standard := result.get("standard_model"):
        named = ", ".join(standard["otherwise"]) or "nothing otherwise than stated"
        lines.append(f"The field's standard model: {milli(standard['error'], unit)} on held-out trials ({named}).")
    if experiment is not None:
        lines += next_steps(experiment, result.get("units", {}))
    return "\n".join(lines)


def restated(recording: Recording, model: ModelFile) -> list[str]:
    """Return the constants whose interval leaves out what the owner states, and which are far from it."""
    lines = []
    for key, joint, one in ((key, joint, one) for key, row in model.values.items() for joint, one in row.items()):
        stated = recording.stated(key, joint)
        if stated is None or not one.low < one.high or one.low <= stated <= one.high:
            continue
        if abs(one.value - stated) > FAR * abs(stated):
            unit = of_joint(one.unit, recording.units[joint])
            also = ", or viscous friction beside it" if key == "kd" else ""
            interval = f"[{one.low:.4g}, {one.high:.4g}]"
            lines.append(f"{key} at {joint} {one.value:.4g} {interval}, not {stated:.4g} {unit}{also}")
    return lines


def error_of(result: Mapping[str, Any]) -> str:
    """Return the label of the reported errors: on test trials or held-out trials."""
    tested = result.get("tested")
    return f"Error on {len(tested)} test trials, used neither to fit nor to select" if tested else "Held-out error"


def headline(result: Mapping[str, Any]) -> str:
    """Return the verdict as a sentence."""
    if result["verdict"] == "unknown_effect" and result.get("partial_effects"):
        return PARTIAL
    shares = [one.get("black_box", 1.0) for one in result.get("unexplained", [])]
    if result["verdict"] == "unknown_effect" and shares and max(shares) < NO_LAW:
        return UNRELATED
    if result["verdict"] == "missing_effect" and len({entry["name"] for entry in result["effects"]}) > 1:
        return SEVERAL
    return OPENING[result["verdict"]]


def left_over(result: Mapping[str, Any]) -> str:
    """Describe the error that remains with the named effects, if it is above the noise."""
    error = result["error"]
    if result["verdict"] in ("adequate", "unknown_effect") or not error.get("noise_floor"):
        return ""
    floors = error["with_effects"] / error["noise_floor"]
    left = milli(error["with_effects"], common_unit(result.get("shown_in", result.get("units", {})).values()))
    windows = result.get("error_over_noise", {}).get("with_effects", floors)
    if windows < LEFT < floors:
        return f" ({windows:.2f} sensor noises remain in short windows; in a free run it deviates by {left})"
    return f" ({left} remain, {short(floors, 2)} noise floors)" if floors > LEFT else ""


def sets_in_words(sets: Sequence[Sequence[str]]) -> str:
    """List sets of effects that explain a recording equally: `backlash@q1 and payload@q2, or elasticity@q1`."""
    return ", or ".join(" and ".join(names) for names in sets)


def values_in_words(parameters: Mapping[str, Mapping[str, Any]], unit: str) -> str:
    """Return the values with intervals as text, for a joint of that unit."""
    return ", ".join(
        f"{name} {one['value']:.4g} [{one['low']:.4g}, {one['high']:.4g}] {of_joint(one['unit'], unit)}"
        for name, one in parameters.items()
    )


def _effect(entry: dict[str, Any], units: Mapping[str, str]) -> str:
    own = common_unit(units[joint] for joint in entry["joints"] if joint in units)
    return f"  {entry['name']} at {', '.join(entry['joints'])}: {values_in_words(entry['parameters'], own)}"


def _unexplained(entry: dict[str, Any], units: Mapping[str, str]) -> str:
    if entry.get("explained", 0.0) > NO_LAW:
        return (
            f"  {entry['joint']}: the effects explain {100 * entry['explained']:.0f} % of the torque missing in the "
            f"refitted model, {100 * entry['of_explainable']:.0f} % of what they and a black-box model explain together"
        )
    if entry["black_box"] < NO_LAW:
        return (
            f"  {entry['joint']}: a black-box model of positions, speeds, torque and time explains none of the rest. "
            "Look for what is not logged: pushes, temperature, supply, timing"
        )
    signal, _ = named(entry["depends_most_on"] or "no logged signal", units)
    return (
        f"  {entry['joint']}: the torque missing in {entry['beside']} follows {signal} most; "
        f"a black-box model could explain {100 * entry['black_box']:.0f} % of what the recommended model leaves"
    )


def unproven_effects(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the effects of which one may be the missing one, and what to do about it."""
    lines = [
        f"{' & '.join(one['effects'])} would reduce the held-out squared error by {100 * one['heldout_gain']:.0f} % "
        f"(p {one['p_value']:.2g})"
        for one in entries
    ]
    return [
        *lines,
        f"{entries[0]['segments']} held-out windows are too few to rule out chance: play the next experiment.",
    ]


def common_offset(entry: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """Describe a joint offset that all initialisations share, and how to find its source."""
    offset = milli(entry["offset"], units.get(entry["joint"], TURNS))
    return (
        f"{entry['joint']} reads about {offset} too much in each of {entry['initialisations']} "
        "initialisations: by chance, or its encoder's zero is wrong (position_offset). Record more initialisations."
    )


def disturbed(result: Mapping[str, Any]) -> list[str]:
    """Describe the intervals that follow no model, left out or suspected, and what to do about them."""
    lines = []
    for key, opening in (("left_out", "Left out"), ("suspected", "Not left out")):
        for one in result.get(key, []):
            other = one["repeats"]
            runs = f"{other} other runs of its command do" if other > 1 else "the other run of it does"
            beside = f"though {runs}" if other else "and nothing repeats it"
            lines.append(
                f"{opening}: {one['trial']} from {one['start']:.2f} to {one['end']:.2f} s follows no model, "
                f"{beside}. {one['joint']}'s error there is {short(one['error'], 2)} x its sensor noise, elsewhere "
                f"{short(one['usual'], 2)}. If somebody pushed, write `exclude: "
                f"[[{one['start']:.2f}, {one['end']:.2f}]]` below it in recording.yaml, for the other commands too."
            )
    return lines


def unseen_effects(result: Mapping[str, Any]) -> list[str]:
    """List the effects that no trial could reveal, one per line."""
    joints: dict[str, list[str]] = {}
    for one in result.get("unseen", []):
        joints.setdefault(one["effect"], []).append(f"{one['joint']} ({one['why']})")
    return [f"These trials cannot reveal {name} at {', '.join(at)}." for name, at in joints.items()]


def errors_by_stage(stages: Mapping[str, float], model: ModelFile, units: Mapping[str, str]) -> str:
    """List the held-out error of each stage, and the values of the fitted effects."""
    unit = common_unit(units.values())
    lines = ["Held-out error, free-running simulation:"]
    lines += [f"  {stage.replace('_', ' '):<40} {milli(value, unit)}" for stage, value in stages.items()]
    for effect in model.effects:
        fitted = {name: one.model_dump() for name, one in effect.parameters.items() if one.high > one.low}
        lines.append(f"{effect.effect}: {values_in_words(fitted, units.get(effect.joint or '', TURNS))}")
    return "\n".join(lines)


MODELS = "each explanation, also with parameters at either end of their intervals"
PLENTY = 100.0  # times the evidence that is needed; larger ratios are shown as "more than" this


def next_steps(experiment: Experiment, units: Mapping[str, str]) -> list[str]:
    """Describe the command to play, when to stop it, and the explanations that no command separates."""
    beyond = "stop beyond" if experiment.safety.safe else "allowed"
    lines = [
        f"  {joint}: {position}, {speed}, {torque}; {beyond} {', '.join(bounds)}"
        for joint, position, speed, torque, *bounds in joint_rows(experiment, units)
    ]
    return [*proposal(experiment), *lines, *watch_for(experiment, units)]


def proposal(experiment: Experiment) -> list[str]:
    """Describe the command to play, or state that no command is safe or decides."""
    safety, seconds = experiment.safety, _seconds(experiment)
    size = "" if safety.scale == 1.0 else f" at {_percent(safety.scale)} of full size"
    command = f"{experiment.name}{size}, {seconds}"
    if not safety.safe:
        return [
            f"No safe command was found: each kind, down to {_percent(SCALES[-1])} of its size, leaves the limits in "
            f"at least one of {safety.models} models ({MODELS}). What {command}, reach in the first model that leaves "
            "them:"
        ]
    lines = [
        f"No command tried separates {one} from {other}: within its limits the machine moves alike either way."
        for one, other in experiment.inseparable
    ]
    if not experiment.decides:
        return lines
    told = short(experiment.told, 2) if experiment.told < PLENTY else f"more than {PLENTY:g}"
    starts = f" from {len(safety.starts)} starts" if len(safety.starts) > 1 else ""
    return [
        *lines,
        f"To decide, play {FILE} twice, add both trials and diagnose again: {command}. Each should give {told} times "
        "the evidence needed to reject the wrong one, however it is refitted.",
        f"Simulated for the whole {seconds} in {safety.models} models ({MODELS}){starts}. The largest values in any of "
        f"them, and where to stop: {_percent(safety.margin)} inside stated limits, else where the trials ended:",
    ]


def joint_rows(experiment: Experiment, units: Mapping[str, str]) -> list[tuple[str, ...]]:
    """Return joint; furthest position, speed and torque in any model; the same of what is allowed, with who says so."""
    safety, rows = experiment.safety, list[tuple[str, ...]]()
    for j, joint in enumerate(experiment.joints if experiment.decides or not safety.safe else ()):
        unit = units.get(joint, TURNS)
        reached, allowed = (
            (
                f"{short(envelope.low[j])} to {short(envelope.high[j])} {unit}",
                f"{short(envelope.speed[j])} {unit}/s",
                f"{short(envelope.torque[j])} {of_joint('N m', unit)}",
            )
            for envelope in (safety.reached, safety.allowed)
        )
        sources = [safety.limits.sources[key][j] for key in QUANTITIES]
        rows.append((joint, *reached, *(f"{one} ({by})" for one, by in zip(allowed, sources, strict=True))))
    return rows


def watch_for(experiment: Experiment, units: Mapping[str, str]) -> list[str]:
    """Describe what to watch for, or what would help if no command is safe or no safe command decides."""
    safety = experiment.safety
    if not experiment.decides:
        unstated = [key for key in QUANTITIES if TRIALS in safety.limits.sources[key]]
        ways = [
            *(["control the position instead of playing torques open loop"] if safety.open_loop else []),
            "record shorter runs that start nearer the middle of the range",
            *([f"state limits of {' and '.join(unstated)} (URDF, controller)"] if unstated else []),
        ]
        return [f"What would help: {'; '.join(ways)}."] if safety.open_loop or not safety.safe else []
    begin = ", ".join(
        f"{joint} {short(float(value))} {units.get(joint, TURNS)}"
        for joint, value in zip(experiment.joints, safety.starts[-1], strict=True)
    )
    lines = [
        f"Begin at rest at {begin}. Keep a hand on the emergency stop. Stop when a joint goes beyond these limits, "
        "moves against its command or shakes: then none of these models is right."
    ]
    if safety.open_loop:
        lines.append(
            f"These commands are torques or forces, open loop for {_seconds(experiment)}, and unstable by nature: "
            "small errors add up. If you can, control the position instead and log the torque."
        )
    return lines


def _percent(part: float) -> str:
    return f"{100 * part:.0f} %"


def _seconds(experiment: Experiment) -> str:
    return f"{short(float(experiment.time[-1]))} s"
