"""Sections of a comparison's report; the other reports use them too."""

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.visualization import comparison_figures as figures
from tactile_cube.visualization.numbers import mrad, p_value
from tactile_cube.visualization.report import Block, Callout, Figure, Listing, Section, Table

MOST_OVERLAYS = 6
MOST_CORRELATIONS = 8
MOST_WARNINGS = 4
FLOORS = {
    "repeats": "The noise floor is the scatter of trials that repeated one command, together with the error of the "
    "simulator's own time step.",
    "guess": "Nothing was repeated, so the noise floor is a guess from the fast part of the signals and the sensor's "
    "resolution, together with the error of the simulator's own time step.",
    "contact": "The noise floor is what the world leaves of a grasp when all contact effects are true: drives are "
    "known to some 10 % only, and the contact solver stops early. Each trial has the joint offsets and the place of "
    "the object that suit it.",
}


def recording_section(recording: Recording, model: ModelFile | None) -> Section:
    """What was compared with what, and what was odd about the recording."""
    seconds = sum(trial.duration for trial in recording.trials)
    kinds = ", ".join(dict.fromkeys(trial.kind for trial in recording.trials))
    starts = len({trial.initialisation for trial in recording.trials})
    said = "the values that the rig's owner believes (recording.yaml)"
    if model is not None:
        effects = ", ".join(one.effect for one in model.effects) or "no added effect"
        said = f"a model file: values for {', '.join(model.values) or 'no constant'}; {effects}"
    rows = [
        ("recording", str(recording.folder)),
        (
            "joints",
            ", ".join(recording.joints) + (f" (coupled: {', '.join(recording.coupled)})" if recording.coupled else ""),
        ),
        ("trials", f"{len(recording.trials)} of {kinds}; {seconds:.0f} s at {recording.rate:g} Hz"),
        ("robot initialisations", f"{starts}, each with joint offsets of its own"),
        ("simulated with", said),
    ]
    more = len(recording.warnings) - MOST_WARNINGS
    shown = [*recording.warnings[:MOST_WARNINGS], *([f"and {more} more, see the terminal"] if more > 0 else [])]
    odd = Callout(f"{len(recording.warnings)} things were odd about this recording:", "warn")
    warnings: list[Block] = [odd, Listing(shown)] if shown else []
    text = [
        "The same commands that the rig received were given to the simulation. It started where the rig started and "
        "then ran freely to the end of each trial: nothing pulls it back to the measurement."
    ]
    return Section("What was compared", text, [Table(("", ""), rows), *warnings])


def error_section(comparison: Comparison) -> Section:
    """The error of each joint beside its noise floor."""
    floor = comparison.floor
    rows = []
    for joint, error in comparison.errors.joints.items():
        step = floor.step_size.get(joint, 0.0)
        rows.append((joint, mrad(error), mrad(floor.joints[joint]), f"{error / floor.joints[joint]:.2f}", mrad(step)))
    rows.append(("all", mrad(comparison.errors.overall), mrad(floor.overall), f"{comparison.ratio:.2f}", ""))
    text = [
        f"{FLOORS[floor.source]} A perfect model would score 1 in the column 'error / floor'; a model that scores 3 "
        "leaves something out that is three times as large as the noise."
    ]
    header = ("joint", "error (RMS)", "noise floor", "error / floor", "of it time step")
    guess = [Callout("The noise floor is a guess: repeat each kind of trial to measure it.", "warn")]
    return Section("How well", text, [Table(header, rows), *(guess if floor.source == "guess" else [])])


def where_section(comparison: Comparison, title: str = "Where it fails") -> Section:
    """In words, and as a map of joints and regimes."""
    caption = (
        "Error / noise floor of each joint in each regime: 1 is noise, red is where the model fails. A cell that "
        "stands out in its row is a hint at what is missing: friction shows just after reversals and at low speed, "
        "delay and inertia at high speed, gravity and springs by posture."
    )
    blocks: list[Block] = [Listing(comparison.sentences), Figure(figures.regime_map(comparison), caption)]
    return Section(title, (), blocks)


def overlay_section(comparison: Comparison, title: str = "Measured and simulated") -> Section:
    """Measured over simulated, the worst trial of each joint."""
    blocks = []
    order = sorted(comparison.errors.joints, key=lambda j: -comparison.errors.joints[j] / comparison.floor.joints[j])
    for name in order[:MOST_OVERLAYS]:
        joint = comparison.recording.joints.index(name)
        trial = figures.worst_trial(comparison, joint)
        one = comparison.recording.trials[trial]
        error = comparison.trials[trial].joints[name]
        blocks.append(
            Figure(
                figures.overlay(comparison, trial, joint),
                f"{name}, its worst trial {one.name} ({one.kind}): {mrad(error)}.",
            )
        )
        blocks.append(
            Figure(
                figures.residual(comparison, trial, joint),
                "What the simulation did not follow. Shaded red: more than three noise floors.",
            )
        )
    return Section(title, (), blocks)


def band_section(comparison: Comparison) -> list[Section]:
    """The measurement among randomised simulations."""
    if comparison.band is None:
        return []
    text = [
        f"{comparison.band.simulations} simulations with constants drawn from their ranges. A policy that is trained "
        "on these ranges has met the real rig if the measured line lies in the band: 95 % of the samples should, and "
        f"{100 * comparison.band.inside:.0f} % do."
    ]
    rows = [(joint, f"{100 * share:.0f} %") for joint, share in comparison.band.joints.items()]
    blocks: list[Figure | Table] = [Table(("joint", "measured samples inside"), rows)]
    for name in list(comparison.errors.joints)[:MOST_OVERLAYS]:
        joint = comparison.recording.joints.index(name)
        trial = figures.worst_trial(comparison, joint)
        trial_name = comparison.recording.trials[trial].name
        blocks.append(
            Figure(
                figures.band(comparison, trial, joint),
                f"{name} in {trial_name}: difference from the simulation with the central values.",
            )
        )
    return [Section("Among randomised simulations", text, blocks)]


def test_section(comparison: Comparison) -> Section:
    """Whiteness and cross-correlation tests."""
    text = [
        "If nothing is missing, what is left is noise: it neither remembers itself (whiteness) nor goes with any "
        "other signal (cross-correlation). A free-running simulation integrates every small error, so a short memory "
        "is normal."
    ]
    memory = [(w.joint, f"{1e3 * w.correlation_time:.0f} ms", p_value(w.p_value)) for w in comparison.whiteness]
    strongest = [
        (f"{c.joint} residual", c.cause, f"{c.correlation:+.2f}", f"{1e3 * c.delay:.0f} ms", p_value(c.p_value))
        for c in comparison.cross_correlations[:MOST_CORRELATIONS]
    ]
    blocks = [
        Table(("joint", "memory of the residual", "p (white noise)"), memory),
        Table(("", "goes with", "correlation", "after", "p (unrelated)"), strongest),
    ]
    return Section("Is it noise?", text, blocks)


def method_section() -> Section:
    """How the numbers were made."""
    lines = [
        "Error: root mean square of measured minus simulated angle over all samples of all trials; the mean "
        "difference of each joint in each robot initialisation is removed first, because a joint's zero is "
        "calibrated anew each time.",
        "Noise floor: standard deviation of repeats of one command about their mean, and, added in quadrature, the "
        "difference between the simulation at its own time step and at an eighth of it.",
        "Just after a reversal: within 0.2 s after a joint's velocity changed its sign. Standstill, low, medium and "
        "high speed: below 0.02, 0.3, 1.5 rad/s and above. Low and high load: below and above half of the largest "
        "torque.",
        "Whiteness: Ljung-Box test over 20 lags. Cross-correlation: the strongest within 0.1 s; its p-value allows "
        "for the memory of both signals.",
    ]
    return Section("How this was computed", (), [Listing(lines)], folded=True)


def floor_source(floor: NoiseFloor) -> str:
    """Where the noise floor comes from, in words."""
    if floor.source == "contact":
        return "what a world with the true effects leaves of a grasp"
    return f"from {floor.repeats} repeats" if floor.source == "repeats" else "a guess: nothing was repeated"
