"""A comparison in words, for the terminal."""

from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.units import THOUSANDTHS, common_unit, milli, short


def summary(comparison: Comparison) -> str:
    """What the command line prints: the answer, one line a joint, where it fails."""
    errors, floor, raw = comparison.errors, comparison.floor, comparison.raw[0]
    unit = common_unit(comparison.recording.units.values())
    rows = [
        f"{joint:<16}{_numbers(error, floor.joints[joint], raw.joints[joint])}{comparison.fit[joint]:>7.1f} %"
        for joint, error in errors.joints.items()
    ]
    lines = [
        outcome(comparison),
        "",
        f"{'joint':<16}{'error':>9}{'floor':>9}  error / floor      raw      fit",
        *rows,
        f"{'all':<16}{_numbers(errors.overall, floor.overall, raw.overall)}",
        f"RMS of free runs from the first state, {THOUSANDTHS[unit]}. error: the joint offsets of each initialisation "
        "removed; raw: nothing removed; fit: 100 % (1 - |raw error| / |motion|)",
        "",
        f"noise floor: {_source(floor)}",
    ]
    step = f"the simulator's own time step, {1e3 * comparison.step:g} ms,"
    for name, by_joint in (("sensor noise", floor.sensor), (step, floor.step_size)):
        if by_joint:
            size = (sum(value**2 for value in by_joint.values()) / len(by_joint)) ** 0.5
            lines.append(f"beside it: {name} {milli(size, unit)}")
    if (band := comparison.band) is not None:
        share = f"{100 * band.inside:.0f} % of the samples"
        lines.append(f"measured inside the band of {band.simulations} simulations: {share}")
    return "\n".join([*lines, "", *(f"- {sentence}" for sentence in comparison.sentences)])


def outcome(comparison: Comparison) -> str:
    """The result in one or two sentences."""
    unit = common_unit(comparison.recording.units.values())
    head = (
        f"The simulated joints are {milli(comparison.errors.overall, unit)} (RMS) away from the measured ones; "
        f"{milli(comparison.floor.overall, unit)} would be noise alone."
    )
    if comparison.at_the_floor:
        return f"{head} The model is as good as this recording can tell."
    return f"{head} That is {short(comparison.ratio)} times the noise: {comparison.sentences[0]}."


def _numbers(error: float, floor: float, raw: float) -> str:
    return f"{1e3 * error:>9.3f}{1e3 * floor:>9.3f}{error / floor:>15.2f}{1e3 * raw:>9.3f}"


def _source(floor: NoiseFloor) -> str:
    if floor.source == "contact":
        return "what a world with the true effects leaves of a grasp"
    return f"scatter of {floor.repeats} repeats" if floor.source == "repeats" else "sensor noise, a guess: no repeats"
