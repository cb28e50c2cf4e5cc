"""What a workbench says in tables and cards: the error by stage, the test of what is left, an effect."""

from importlib import resources
from itertools import pairwise

from tactile_cube.api.effects import effects
from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import milli
from tactile_cube.workbench.state import BY_HAND, ModelStage, Workbench
from tactile_cube.workbench.text import Html, html, listed, picture

WORSE = "worse than before: Undo takes it back"
NO_BETTER = "no better than before"
BAR = Html('<td style="width:40%"><div style="background:{};width:{:.1f}%;height:1em"></div></td>')
ROW, TABLE = Html("<tr>{}</tr>"), Html('<table cellpadding="4" style="{}">{}</table>')
CELL, HEAD, NUMBER = (
    Html("<td>{}</td>"),
    Html("<th>{}</th>"),
    Html("<td style='text-align:right;white-space:nowrap'>{}</td>"),
)
BLUE, ORANGE = "#9cc6e6", "#f0b08a"
FOLDED = Html('<details style="color:#57606a"><summary>{}</summary>{}</details>')
CARD = Html('<div style="border:1px solid #d0d7de;border-radius:6px;padding:6px 10px"><b>{}</b>{}{}{}</div>')
CAUSES = 5  # signals that the residual is compared with, the strongest


def error_by_stage(bench: Workbench) -> Html:
    """Return the error over noise of every stage, what made it no better, and behind a fold the free runs."""
    stages = bench.stages
    most = max(*(stage.over_noise for stage in stages), 1e-9)
    rows = []
    for stage, note in zip(stages, ["", *(remark(*pair) for pair in pairwise(stages))], strict=True):
        color = ORANGE if note or stage.label == BY_HAND else BLUE
        bar = BAR.format(color, 100.0 * stage.over_noise / most)
        number = NUMBER.format(f"{stage.over_noise:.2f}")
        rows.append(ROW.format(html(CELL.format(stage.label), number, bar, CELL.format(note))))
    names = ", ".join(trial.name for trial in bench.untouched.trials)
    return html(
        TABLE.format("width:100%", html(*rows)),
        f"Error over sensor noise in short segments of {names}, which no model was fitted to; a perfect one has 1.",
        FOLDED.format("free runs of these trials, joint by joint", _free_runs(bench)),
    )


def remark(before: ModelStage, after: ModelStage) -> str:
    """Return what has to be said of a stage that is no progress."""
    if after.over_noise > before.over_noise:
        return WORSE
    gained = 1.0 - (after.over_noise / before.over_noise) ** 2
    return NO_BETTER if gained < STANDARD.least_gain and after.label.startswith("+") else ""


def error_of_trial(compared: Comparison, joint: str) -> Html:
    """Return how far a joint's free run is from one trial, where, and behind a fold whether that is noise."""
    units = compared.recording.shown
    error = f"{joint} in this trial: {milli(compared.errors.joints[joint], units[joint])} RMS of the free run"
    white = next(one for one in compared.whiteness if one.joint == joint)
    lines = [
        f"white noise would be as correlated with p = {white.p_value:.2g}; its memory is {white.correlation_time:.3g} s"
    ]
    causes = [one for one in compared.cross_correlations if one.joint == joint][:CAUSES]
    lines += [
        f"{one.cause}: correlation {one.correlation:.2f}, {one.delay:.3f} s later, p {one.p_value:.2g}"
        for one in causes
    ]
    return html(
        listed([error, *(one for one in compared.sentences if one.startswith(f"{joint} "))]),
        FOLDED.format("residual test", listed(lines)),
    )


def card(name: str, *lines: str) -> Html:
    """Return an effect of the catalogue, or a user's own by its name alone, with lines of the page's own."""
    if name not in catalogue():
        return CARD.format(name, listed(lines), "", "")
    (one,) = effects(name)
    notes = (f"{title}: {text}".replace("`", "") for title, text in one.notes.items() if title != "Source")
    file = resources.files("tactile_cube.visualization").joinpath("effects", f"{name}.png")
    seen = picture(f"measured less simulated angle without {name}", file.read_bytes()) if file.is_file() else ""
    return CARD.format(name, listed(lines), listed([one.summary, *notes]), seen)


def _free_runs(bench: Workbench) -> Html:
    joints, units = bench.recording.joints, bench.recording.shown
    floor = "noise floor" + ("" if bench.floor.source == "repeats" else " (guess: no repeats)")
    errors = [(stage.label, stage.errors.joints) for stage in bench.stages] + [(floor, bench.floor.joints)]
    rows = [html(HEAD.format(""), *map(HEAD.format, joints))]
    rows += [
        html(CELL.format(name), *(NUMBER.format(milli(one[joint], units[joint])) for joint in joints))
        for name, one in errors
    ]
    return TABLE.format("", html(*map(ROW.format, rows)))
