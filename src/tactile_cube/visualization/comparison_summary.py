"""A comparison in the terminal, and as Markdown beside the robot."""

from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.units import THOUSANDTHS, common_unit, milli, short


def summary(comparison: Comparison) -> str:
    """What the command line prints: the answer, one line a joint, where it fails."""
    units = comparison.recording.units
    said = THOUSANDTHS[common_unit(units.values())]
    lines = [outcome(comparison), "", f"{'joint':<16}{'error':>9}{'floor':>9}  error / floor      raw      fit"]
    for joint, error in comparison.errors.joints.items():
        floor, raw = comparison.floor.joints[joint], comparison.raw[0].joints[joint]
        numbers = f"{1e3 * error:>9.3f}{1e3 * floor:>9.3f}{error / floor:>15.2f}{1e3 * raw:>9.3f}"
        lines.append(f"{joint:<16}{numbers}{comparison.fit[joint]:>7.1f} %")
    overall, floor = comparison.errors.overall, comparison.floor.overall
    numbers = (
        f"{1e3 * overall:>9.3f}{1e3 * floor:>9.3f}{comparison.ratio:>15.2f}{1e3 * comparison.raw[0].overall:>9.3f}"
    )
    lines += [
        f"{'all':<16}{numbers}",
        f"RMS of free runs from the first state, {said}. error: the joint offsets of each initialisation removed; raw: "
        "nothing removed; fit: 100 % (1 - |raw error| / |motion|)",
    ]
    lines += ["", *floor_in_words(comparison.floor, common_unit(units.values()), comparison.step)]
    if comparison.band is not None:
        inside = 100 * comparison.band.inside
        lines.append(
            f"measured inside the band of {comparison.band.simulations} simulations: {inside:.0f} % of the samples"
        )
    return "\n".join([*lines, "", *(f"- {sentence}" for sentence in comparison.sentences)])


def markdown(comparison: Comparison) -> str:
    """The same for a reader of the Rerun recording."""
    units = comparison.recording.units
    rows = [
        f"| {joint} | {milli(error, units[joint])} | {milli(comparison.floor.joints[joint], units[joint])} |"
        for joint, error in comparison.errors.joints.items()
    ]
    table = ["| joint | error | noise floor |", "|---|---|---|", *rows]
    where = [f"- {sentence}" for sentence in comparison.sentences]
    return "\n".join([f"# {comparison.recording.name}", "", outcome(comparison), "", *table, "", *where])


def outcome(comparison: Comparison) -> str:
    """The result in one or two sentences."""
    error, floor, ratio = comparison.errors.overall, comparison.floor.overall, comparison.ratio
    unit = common_unit(comparison.recording.units.values())
    head = (
        f"The simulated joints are {milli(error, unit)} (RMS) away from the measured ones; {milli(floor, unit)} would "
        "be noise alone."
    )
    if comparison.at_the_floor:
        return f"{head} The model is as good as this recording can tell."
    return f"{head} That is {short(ratio)} times the noise: {comparison.sentences[0]}."


def floor_source(floor: NoiseFloor) -> str:
    """Where the noise floor comes from, in words."""
    if floor.source == "contact":
        return "what a world with the true effects leaves of a grasp"
    return f"scatter of {floor.repeats} repeats" if floor.source == "repeats" else "sensor noise, a guess: no repeats"


def floor_in_words(floor: NoiseFloor, unit: str, step: float) -> list[str]:
    """The noise floor and what stands beside it, each by its name; `step` is the simulator's [s]."""
    lines = [f"noise floor: {floor_source(floor)}"]
    for name, by_joint in (
        ("sensor noise", floor.sensor),
        (f"the simulator's own time step, {1e3 * step:g} ms,", floor.step_size),
    ):
        if by_joint:
            size = (sum(value**2 for value in by_joint.values()) / len(by_joint)) ** 0.5
            lines.append(f"beside it: {name} {milli(size, unit)}")
    return lines
