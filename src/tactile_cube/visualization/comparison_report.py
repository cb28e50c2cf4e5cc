"""What `compare` says in the terminal and in its report: how well the model follows, where it fails, how sure."""

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.comparing.comparison import AT_THE_FLOOR, Comparison
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.units import MILLION, SMALL, common_unit, milli, short
from tactile_cube.visualization import charts as figures
from tactile_cube.visualization.report import Block, Figure, Listing, Report, Section, Table

SUSPICIOUS = 300.0  # times the noise: more than effects usually leave
MOST_OVERLAYS = 6
MOST_CORRELATIONS = 8
MOST_WARNINGS = 4
FLOORS = {
    "repeats": "The noise floor is the scatter of repeats: how much trials of one command differ. It contains sensor "
    "noise and what the machine does not repeat.",
    "guess": "Nothing was repeated, so the noise floor is a guess: the position sensor's noise, from the fast part of "
    "the signals and the sensor's resolution. It does not contain what the machine does not repeat: repeat each kind "
    "of trial to measure that.",
    "contact": "The noise floor is the error of a grasp with all true contact effects: drives are known to some 10 % "
    "only, and the contact solver stops early. Joint offsets and the object's place are fitted to each trial.",
}


def summary(comparison: Comparison) -> str:
    """Return the output of the command line: the outcome, one line per joint, where it fails."""
    errors, floor, raw = comparison.errors, comparison.floor, comparison.raw[0]
    unit = common_unit(comparison.recording.shown.values())
    small, times = SMALL[unit]
    table = [(joint, error, floor.joints[joint], raw.joints[joint]) for joint, error in errors.joints.items()]
    rows = []
    for joint, error, noise, plain in [*table, ("all", errors.overall, floor.overall, raw.overall)]:
        cells = ((times * error, 9, 3), (times * noise, 9, 3), (error / noise, 15, 2), (times * plain, 9, 3))
        numbers = "".join(_cell(*cell) for cell in cells)
        rows.append(f"{joint:<16}{numbers}" + (f"{_cell(comparison.fit[joint], 7, 1)} %" if joint != "all" else ""))
    sources = {
        "contact": "what a world with the true effects leaves of a grasp",
        "repeats": f"scatter of {floor.repeats} repeats",
        "guess": f"sensor noise, a guess: {'repeats drift' if floor.drift else 'no repeats'}",
    }
    lines = [
        outcome(comparison),
        "",
        f"{'joint':<16}{'error':>9}{'floor':>9}  error / floor      raw      fit",
        *rows,
        f"RMS of free runs from the first state, {small}. error: the joint offsets of each initialisation "
        "removed; raw: nothing removed; fit: 100 % (1 - |raw error| / |motion|)",
        "",
        f"noise floor: {sources[floor.source]}",
    ]
    step = f"the simulator's own time step, {1e3 * comparison.step:g} ms,"
    for name, by_joint in (("sensor noise", floor.sensor), (step, floor.step_size)):
        if by_joint:
            size = (sum(value**2 for value in by_joint.values()) / len(by_joint)) ** 0.5
            lines.append(f"beside it: {name} {milli(size, unit)}")
    if (band := comparison.band) is not None:
        lines.append(
            f"measured inside the band of {band.simulations} simulations: {100 * band.inside:.0f} % of the samples"
        )
    return "\n".join([*lines, "", *(f"- {sentence}" for sentence in comparison.sentences)])


def outcome(comparison: Comparison) -> str:
    """Return the result in one or two sentences."""
    unit = common_unit(comparison.recording.shown.values())
    head = (
        f"The simulated joints are {milli(comparison.errors.overall, unit)} (RMS) away from the measured ones; "
        f"{milli(comparison.floor.overall, unit)} would be noise alone."
    )
    if comparison.diverged:
        return (
            f"{head} This simulation tells nothing: its own time step changes it by more than the joints move. Gains "
            "too stiff for the inertia do that: check kp, kd, nominal.reflected_inertia and the URDF's inertias."
        )
    if comparison.at_the_floor:
        return f"{head} The model is as good as this recording can tell."
    check = " Check signs, units, gains and the order of joints first." if comparison.ratio > SUSPICIOUS else ""
    return f"{head} That is {short(comparison.ratio)} times the noise: {comparison.sentences[0]}.{check}"


def _cell(value: float, width: int, digits: int) -> str:
    return f"{value:>{width}.{digits}f}" if abs(value) < MILLION else f"{value:>{width}.2g}"


def recording_section(recording: Recording, model: ModelFile | None) -> Section:
    """Describe what was compared with what, and the recording's warnings."""
    seconds = sum(trial.duration for trial in recording.trials)
    kinds = ", ".join(dict.fromkeys(trial.kind for trial in recording.trials))
    starts = len({trial.initialisation for trial in recording.trials})
    followers = recording.description.coupled
    coupled = f" (coupled: {', '.join(followers)})" if followers else ""
    said = "the values stated in recording.yaml"
    if model is not None:
        effects = ", ".join(one.effect for one in model.effects) or "no added effect"
        said = f"a model file: values for {', '.join(model.values) or 'no constant'}; {effects}"
    rows = [
        ("recording", str(recording.folder)),
        ("joints", ", ".join(recording.joints) + coupled),
        ("trials", f"{len(recording.trials)} of {kinds}; {seconds:.0f} s at {recording.rate:g} Hz"),
        ("robot initialisations", f"{starts}, each with joint offsets of its own"),
        ("simulated with", said),
    ]
    rows += [("odd", warning) for warning in recording.warnings[:MOST_WARNINGS]]
    if (more := len(recording.warnings) - MOST_WARNINGS) > 0:
        rows.append(("odd", f"and {more} more, see the terminal"))
    text = [
        "The simulation received the rig's commands. It started where the rig started and ran freely to the end of "
        "each trial: nothing pulls it back to the measurement."
    ]
    return Section("What was compared", text, [Table(("", ""), rows)])


def error_section(comparison: Comparison) -> Section:
    """Show the error of each joint beside its noise floor."""
    floor, units = comparison.floor, comparison.recording.shown
    rows = []
    for joint, error in comparison.errors.joints.items():
        known = (error, floor.joints[joint], floor.sensor.get(joint), floor.step_size.get(joint))
        first, second, *beside = ["" if one is None else milli(one, units[joint]) for one in known]
        rows.append((joint, first, second, f"{error / floor.joints[joint]:.2f}", *beside))
    unit = common_unit(units.values())
    overall = (milli(comparison.errors.overall, unit), milli(floor.overall, unit))
    rows.append(("all", *overall, f"{comparison.ratio:.2f}", "", ""))
    text = (
        f"{FLOORS[floor.source]} A perfect model scores 1 in the column 'error / floor'. A model that scores 3 lacks "
        "something three times as large as the noise. The last two columns are the position sensor's own noise, and "
        "what the simulator's time step adds to any model's error."
    )
    header = ("joint", "error (RMS)", "noise floor", "error / floor", "sensor noise", "time step")
    return Section("How well", [text], [Table(header, rows)])


def where_section(comparison: Comparison, title: str = "Where it fails") -> Section:
    """Say in words, and as a map, in which joints and regimes the error lies."""
    caption = (
        "Error / noise floor of each joint in each regime: 1 is noise, red is where the model fails. An outlier in a "
        "row hints at what is missing. Friction shows just after reversals and at low speed, delay and inertia at high "
        "speed, gravity and springs by joint position."
    )
    return Section(title, (), [Listing(comparison.sentences), Figure(figures.regime_map(comparison), caption)])


def overlay_section(
    comparison: Comparison, title: str = "Measured and simulated", before: Comparison | None = None
) -> Section:
    """Draw measured over simulated, the worst trial of each joint; with `before`, the model as it was is drawn too."""
    worst = before or comparison
    blocks = []
    order = sorted(worst.errors.joints, key=lambda j: -worst.errors.joints[j] / worst.floor.joints[j])
    for name in order[:MOST_OVERLAYS]:
        joint = comparison.recording.joints.index(name)
        trial = figures.worst_trial(worst, joint)
        one, unit = comparison.recording.trials[trial], comparison.recording.shown[name]
        error = milli(comparison.trials[trial].joints[name], unit)
        fell = error if before is None else f"{milli(before.trials[trial].joints[name], unit)} before, {error} after"
        caption = f"{name}, its worst trial {one.name} ({one.kind}): {fell}."
        blocks.append(Figure(figures.overlay(comparison, trial, joint, before), caption))
        shaded = "Shaded: more than three noise floors." if before is None else "Before, after and noise alone."
        left = figures.residual(comparison, trial, joint, before)
        blocks.append(Figure(left, f"What the simulation did not follow. {shaded}"))
    return Section(title, (), blocks)


def band_section(comparison: Comparison) -> list[Section]:
    """Show the measurement among randomised simulations."""
    if comparison.band is None:
        return []
    text = [
        f"{comparison.band.simulations} simulations with constants drawn from their ranges. Training on these ranges "
        "covers the real rig if the measured line lies in the band. 95 % of the samples should; "
        f"{100 * comparison.band.inside:.0f} % do."
    ]
    rows = [(joint, f"{100 * share:.0f} %") for joint, share in comparison.band.joints.items()]
    blocks: list[Block] = [Table(("joint", "measured samples inside"), rows)]
    for name in list(comparison.errors.joints)[:MOST_OVERLAYS]:
        joint = comparison.recording.joints.index(name)
        trial = figures.worst_trial(comparison, joint)
        where = f"{name} in {comparison.recording.trials[trial].name}"
        caption = f"{where}: difference from the simulation with the central values."
        blocks.append(Figure(figures.band(comparison, trial, joint), caption))
    return [Section("Among randomised simulations", text, blocks)]


def test_section(comparison: Comparison) -> Section:
    """Show the error over the noise floor and, where it is above, the signals that it follows."""
    ratios = {joint: error / comparison.floor.joints[joint] for joint, error in comparison.errors.joints.items()}
    memory = {one.joint: f"{1e3 * one.correlation_time:.0f} ms" for one in comparison.whiteness}
    rows = [(joint, f"{ratio:.2f}", memory[joint]) for joint, ratio in ratios.items()]
    blocks = [Table(("joint", "left, in noise floors", "correlation time of the error"), rows)]
    above = [joint for joint, ratio in ratios.items() if ratio > AT_THE_FLOOR]
    text = (
        f"Not at {', '.join(above)}: the error is above the noise floor. Noise follows no other signal; the error "
        "follows the signals below, which hint at its cause. 'By chance' is the probability of that correlation "
        "between unrelated signals with the same autocorrelation."
        if above
        else "Yes, as far as this recording can tell: no joint's error is above the noise floor. A free-running "
        "simulation integrates every small error, so its error is correlated in time; a test of whiteness says no more "
        "here."
    )
    strongest = [
        (f"{c.joint} error", c.cause, f"{c.correlation:+.2f}", f"{1e3 * c.delay:.0f} ms", probability(c.p_value))
        for c in comparison.cross_correlations
        if c.joint in above
    ]
    if strongest:
        header = ("", "follows", "correlation", "after", "by chance (p)")
        blocks.append(Table(header, strongest[:MOST_CORRELATIONS]))
    return Section("Is it noise?", [text], blocks)


def method_section() -> Section:
    """Describe how the numbers were computed."""
    lines = [
        "Error: root mean square of measured minus simulated angle over all samples of all trials; the mean "
        "difference of each joint in each robot initialisation is removed first, because a joint's zero is "
        "calibrated anew each time.",
        "Noise floor: standard deviation of repeats of one command about their mean, or the sensor's noise where "
        "nothing was repeated; compare, diagnose and identify state the same. Time step: what the simulation's "
        "own step adds, from the difference that steps of an eighth make. A model is at the floor within 1.3 "
        "times both in quadrature.",
        "Just after a reversal: within 0.2 s after a joint's velocity changed its sign. Standstill, low, medium and "
        "high speed: below 0.02, 0.3, 1.5 rad/s and above (m/s where a joint slides). Low and "
        "high load: below and above half of the largest torque.",
        "Correlation time: until the autocorrelation of a joint's error falls below 1/e, on average over the trials. "
        "Correlation with other signals: the strongest within 0.1 s; its p-value allows for the autocorrelation of "
        "both.",
    ]
    return Section("How this was computed", (), [Listing(lines)], folded=True)


def probability(value: float) -> str:
    """Format a probability; very small ones only as below a bound."""
    return "< 0.001" if value < 1e-3 else f"{value:.3f}"


def comparison_report(comparison: Comparison, command: str, model_path: str | None) -> Report:
    """Make the whole page.

    Args:
        comparison: what was found.
        command: the command line that made it.
        model_path: the model file, for the suggested next command; None for the owner's values.
    """
    return Report(
        title=f"Model and measurement: {comparison.recording.name}",
        answer=outcome(comparison),
        tone="good" if comparison.at_the_floor else "warn",
        sections=[
            recording_section(comparison.recording, comparison.model),
            error_section(comparison),
            where_section(comparison),
            overlay_section(comparison),
            *band_section(comparison),
            test_section(comparison),
            _next_section(comparison, model_path),
            method_section(),
        ],
        footer=f"Made by tactile_cube: {command}",
    )


def _next_section(comparison: Comparison, model_path: str | None) -> Section:
    """Show the command to type next."""
    model = f" model={model_path}" if model_path else ""
    if comparison.at_the_floor:
        said = "Nothing is missing at this noise. Check the model on a recording of other motions, or train with it:"
        command = f"python -m tactile_cube.train +experiment=adapt{model or ' model=MODEL.yaml'}"
    else:
        said = "Constants may be off, or an effect missing: diagnose refits the first, then searches for the second."
        command = f"python -m tactile_cube.diagnose recording={comparison.recording.folder}{model}"
    return Section("What to do next", [said], [Listing([command], code=True)])
