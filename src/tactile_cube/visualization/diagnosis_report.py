"""The reports of `diagnose` and `identify`: what is missing, how sure, how far the error falls, what to record next."""

from collections.abc import Mapping, Sequence
from typing import Any

from tactile_cube.identification.contact.identification import ContactIdentification
from tactile_cube.identification.in_words import answer, joint_rows, proposal, watch_for
from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Shape
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.units import SMALL, TURNS, common_unit, milli, named, of_joint, short
from tactile_cube.visualization.charts import PALETTE, SIMULATED, bar_chart, interval_chart, svg, time_chart
from tactile_cube.visualization.comparison_report import (
    overlay_section,
    probability,
    recording_section,
    test_section,
    where_section,
)
from tactile_cube.visualization.report import Block, Figure, Listing, Report, Section, Table, Tone

TRAIN = "python -m tactile_cube.train +experiment=adapt model="
TONES: Mapping[str, Tone] = {"adequate": "good", "missing_effect": "good"}
WIDE = 6  # joints from which on a table has them in its rows
STAGES = {
    "nominal": "as stated",
    "refitted": "known constants refitted",
    "with_effects": "with what was found",
}
MOST_RANKED = 15
COLUMNS = {
    "effects": "effects",
    "held_out_error_over_noise": "held-out error / sensor noise",
    "gain": "share of the squared error it takes off",
    "p_value": "p (no better than without)",
}
INTERVALS = "Values and 95 % intervals, each on a scale of its own; they do not allow for effects that the model lacks."
REACHED = ("joint", "position in any model", "speed", "torque")
HELD = "How the error with an object falls"


def stage_section(
    stages: Mapping[str, float | None],
    joints: Mapping[str, Mapping[str, float]],
    units: Mapping[str, str],
    title: str = "How the error falls",
) -> Section:
    """Show the error after each step, down to the noise floor; `units` are those of the joints."""
    unit, size = SMALL[common_unit(units.values())]
    bars = [(STAGES.get(key, key), size * v) for key, v in stages.items() if key != "noise_floor" and v is not None]
    floor = stages.get("noise_floor")
    caption = (
        "RMS position error on trials that were held out from the fit (where there are enough, on trials "
        "that nothing was chosen by either); the dashed line is what noise alone would leave."
    )
    blocks: list[Block] = [Figure(bar_chart(bars, unit, None if floor is None else size * floor), caption)]
    if joints:
        names = list(next(iter(joints.values())))
        steps = [STAGES.get(stage, stage) for stage in joints]
        cells = [[milli(row[name], units.get(name, TURNS)) for name in names] for row in joints.values()]
        if len(names) > WIDE:
            names, steps, cells = steps, names, [list(column) for column in zip(*cells, strict=True)]
        blocks.append(Table(("", *names), [(step, *row) for step, row in zip(steps, cells, strict=True)]))
    return Section(title, (), blocks)


def held_section(
    stages: Mapping[str, float], joints: Mapping[str, Mapping[str, float]], units: Mapping[str, str]
) -> Section:
    """Show the same for the trials with an object, which refit no constants."""
    return stage_section({k: v for k, v in stages.items() if k != "refitted"}, joints, units, HELD)


def effect_section(effects: Sequence[Mapping[str, Any]], units: Mapping[str, str] | None = None) -> list[Section]:
    """Show every effect that was found: parameters with intervals, held-out gain, rivals."""
    if not effects:
        return []
    intervals, lines = [], []
    for effect in effects:
        place = ", ".join(effect["joints"])
        for name, estimate in effect["parameters"].items():
            one = estimate if isinstance(estimate, Mapping) else estimate.model_dump()
            label = f"{effect['name']}@{place}: {name}"
            unit = of_joint(one["unit"], common_unit((units or {}).get(joint, TURNS) for joint in effect["joints"]))
            intervals.append((label, one["value"], one["low"], one["high"], unit))
        if "heldout_gain" in effect:
            lines.append(
                f"{effect['name']}@{place} takes {100 * effect['heldout_gain']:.0f} % off the held-out squared error "
                f"(p {probability(effect['p_value'])})"
                + (f"; cannot be told from {', '.join(effect['rivals'])}" if effect["rivals"] else "")
            )
    blocks: list[Block] = [Listing(lines)] if lines else []
    blocks.append(Figure(interval_chart(intervals), INTERVALS))
    return [Section("What was found, and how sure that is", (), blocks)]


def shape_section(shapes: Sequence[Shape], units: Mapping[str, str] | None = None) -> list[Section]:
    """Show what the missing torque depends on, where no effect of the catalogue explains it."""
    if not shapes:
        return []
    text = [
        "The torque that the model lacks, averaged over bins of one signal at a time, apart for motion up and down "
        "where that matters. A clear curve is a law of that signal alone; write it as an effect of your own, fit it, "
        "and see whether the error falls."
    ]
    blocks = []
    for one in sorted(shapes, key=lambda shape: -shape.explained):
        torque = of_joint("N m", (units or {}).get(one.joint, TURNS))
        against, size = named(one.against, units or {})
        axes, x = time_chart(f"{one.joint} [m{torque}]", 200, against), size * one.centres
        low, high = 1e3 * (one.mean - one.spread), 1e3 * (one.mean + one.spread)
        label = "+- one standard deviation"
        axes.fill_between(x, low, high, color=SIMULATED, alpha=0.25, linewidth=0, label=label)
        axes.plot(x, 1e3 * one.mean, color=SIMULATED, linewidth=2.0, label="missing torque")
        share = f"explains {100 * one.explained:.0f} % of what {one.beside or 'the model'} lacks."
        blocks.append(Figure(svg(axes), f"{one.joint} against {against}: {share}"))
    return [Section("The shape of what is unexplained", text, blocks)]


def ranking_section(ranking: Sequence[Mapping[str, Any]]) -> list[Section]:
    """Return the section of the candidates considered, best first."""
    rows = ranking[:MOST_RANKED]
    if not rows:
        return []
    keys = [key for key in COLUMNS if rows[0].get(key) is not None]
    cells = [
        ["" if (one := row.get(key)) is None else short(one) if isinstance(one, float) else str(one) for key in keys]
        for row in rows
    ]
    table = Table([COLUMNS[key] for key in keys], cells)
    text = ["Rows without numbers were given up after a first look: others explained more."]
    return [Section("Candidates considered", text, [table], folded=True)]


def value_section(comparison: Comparison) -> Section:
    """Show the constants of the model and their intervals, beside the owner's values."""
    rows = []
    if comparison.model is not None:
        for key, by_joint in comparison.model.values.items():
            for joint, one in by_joint.items():
                interval = f"{short(one.low)} .. {short(one.high)}" if one.high > one.low else "not fitted"
                believed = comparison.recording.stated(key, joint)
                stated = "" if believed is None else short(believed)
                unit = of_joint(one.unit, comparison.recording.units.get(joint, TURNS))
                rows.append((f"{key} {joint}", short(one.value), interval, stated, unit))
    return Section("The constants", (), [Table(("", "value", "95 % interval", "owner's value", "unit"), rows)])


def train_section(model_path: str) -> Section:
    """Show the command to type after an identification."""
    said = "Train with what was found; the intervals become randomisation ranges:"
    return Section("What to do next", [said], [Listing([f"{TRAIN}{model_path}"], code=True)])


def next_section(
    diagnosis: Mapping[str, Any], model_path: str, recording: Recording, experiment: Experiment | None
) -> Section:
    """Show what to record or to type next."""
    if experiment is not None:
        return _experiment_section(experiment, recording.units)
    # Effects of fingertips and object belong to no joint.
    found = [
        one["name"] if joint == "object" else f"{one['name']}@{joint}"
        for one in diagnosis["effects"]
        for joint in one["joints"]
    ]
    names = [*diagnosis.get("known_effects", []), *found]
    own = f"my_rig.MyEffect@{(diagnosis['unexplained_joints'] or ['JOINT'])[0]}"
    identify = f"python -m tactile_cube.identify recording={recording.folder} effects"
    train = f"{TRAIN}{model_path}"
    otherwise: tuple[str, list[str]] = (
        "Look at the shapes above, write the law as an effect of your own, and fit it:",
        [f"{identify}=[{own}]"],
    )
    if diagnosis.get("noise_floor_source") == "contact":
        otherwise = (
            "Record more loads and initialisations, and free motion, which shows the drives; diagnose again.",
            [],
        )
    said, lines = {
        "adequate": ("Train with this model:", [train]),
        "missing_effect": (
            "Fit exactly these effects, and train with the result:",
            [f"{identify}=[{','.join(names)}]", train],
        ),
        "partly_explained": (
            "The model holds what was found: train with it. For the rest, write a law of the shapes and fit both:",
            [train, f"{identify}=[{','.join([*names, own])}]"],
        ),
    }.get(diagnosis["verdict"], otherwise)
    return Section("What to do next", [said], [Listing(lines, code=True)] if lines else [])


def _experiment_section(experiment: Experiment, units: Mapping[str, str]) -> Section:
    """Show the commands that would decide, the rivals' predictions, and the rivals that nothing would separate."""
    rows, blocks = joint_rows(experiment, units), list[Block]()
    if rows:
        bound = "stop beyond" if experiment.safety.safe else "allowed"
        blocks.append(Table((*REACHED, f"{bound}: position", "speed", "torque"), rows))
    if warnings := watch_for(experiment, units):
        blocks.append(Listing(warnings))
    if experiment.decides:
        joint, unit = experiment.joints.index(experiment.joint), units.get(experiment.joint, TURNS)
        predictions = {name: values[:, joint] for name, values in experiment.predictions.items()}
        mean = sum(predictions.values()) / len(predictions)
        small, size = SMALL[unit]
        axes = time_chart(f"{experiment.joint} [{small}]", 220)
        for k, (name, values) in enumerate(predictions.items()):
            axes.plot(experiment.time, size * (values - mean), color=PALETTE[k % len(PALETTE)], label=name)
        caption = f"What each candidate predicts for {experiment.joint} before any refit, relative to their mean."
        blocks.append(Figure(svg(axes), caption))
    return Section("What to record next", proposal(experiment), blocks)


def diagnosis_report(
    diagnosis: dict[str, Any],
    before: Comparison,
    after: Comparison,
    command: str,
    model_path: str,
    shapes: Sequence[Shape] = (),
    experiment: Experiment | None = None,
) -> Report:
    """Make the page of a diagnosis.

    Args:
        diagnosis: the content of diagnosis.json.
        before: the model as it was, beside the recording.
        after: the recommended model beside the recording.
        command: the command line that made it.
        model_path: the recommended model's file.
        shapes: shape of what stays unexplained.
        experiment: the one that would separate the rivals.
    """
    units = before.recording.shown
    return Report(
        title=f"What is missing? {before.recording.name}",
        answer=answer(diagnosis | {"shown_in": units}, None),
        tone=TONES.get(diagnosis["verdict"], "warn"),
        sections=[
            stage_section(diagnosis["error"], diagnosis.get("error_joints", {}), units),
            *(held_section(one["error"], one["error_joints"], units) for one in [diagnosis.get("contact")] if one),
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
    """Make the page of an identification: error of each stage, values found, fitted model beside the recording.

    Args:
        after: the fitted model beside the recording.
        stages: name of a stage -> held-out error [rad], in order, and `noise_floor`.
        joints: the same stage -> joint -> error [rad].
        command: the command line that made it.
        model_path: the model file that was written.
        further: the sections on trials with an object.
    """
    steps = [value for key, value in stages.items() if key != "noise_floor" and value is not None]
    effects = after.model.effects if after.model is not None else []
    found = [{"name": e.name, "joints": [e.joint or "object"], "parameters": e.parameters} for e in effects]
    units = after.recording.shown
    unit = common_unit(units.values())
    return Report(
        title=f"Identified: {after.recording.name}",
        answer=f"The error on trials that the fit never saw fell from {milli(steps[0], unit)} to "
        f"{milli(steps[-1], unit)}; {milli(stages['noise_floor'] or after.floor.overall, unit)} would be noise alone.",
        tone="good",
        sections=[
            stage_section(stages, joints, units),
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
    """Make the page of a diagnosis of fingertips and object alone, from the content of diagnosis.json."""
    units = recording.shown
    return Report(
        title=f"What is missing? {recording.name}",
        answer=answer(result | {"shown_in": units}, None),
        tone=TONES.get(result["verdict"], "warn"),
        sections=[
            held_section(result["error"], result["error_joints"], units),
            *effect_section(result["effects"]),
            *ranking_section(result["ranking"]),
            next_section(result, model_path, recording, None),
        ],
        footer=f"Made by tactile_cube in {result['seconds']:.0f} s: {command}",
    )


def contact_report(found: ContactIdentification, recording: Recording, command: str, model_path: str) -> Report:
    """Make the page of an identification of contact effects alone."""
    unit = common_unit(recording.shown.values())
    effects = [{"name": one.effect, "joints": ["object"], "parameters": one.parameters} for one in found.effects()]
    return Report(
        title=f"Identified: {recording.name}",
        answer=f"The error on trials that the fit never saw fell from {milli(found.errors['nominal'], unit)} to "
        f"{milli(found.errors['with_effects'], unit)}.",
        tone="plain" if found.silent else "good",
        sections=[
            held_section(found.errors, found.joint_errors, recording.shown),
            *effect_section(effects),
            train_section(model_path),
        ],
        footer=f"Made by tactile_cube: {command}",
    )
