"""What a workbench says in tables: the error by stage, and the test of what is left."""

from __future__ import annotations

from itertools import pairwise

from tactile_cube.identification.criteria import STANDARD
from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import milli
from tactile_cube.workbench.state import BY_HAND, ModelStage, Workbench
from tactile_cube.workbench.text import Html, html, listed

WORSE = "worse than before: Undo takes it back"
NO_BETTER = "no better than before"
BAR = Html('<td style="width:40%"><div style="background:{};width:{:.1f}%;height:1em"></div></td>')
BLUE, ORANGE = "#9cc6e6", "#f0b08a"
FOLDED = Html('<details style="color:#57606a"><summary>{}</summary>{}</details>')
CAUSES = 5  # signals that the residual is compared with, the strongest


def error_by_stage(bench: Workbench) -> Html:
    """Return the error over noise of every stage, what made it no better, and behind a fold the free runs in mrad."""
    stages = bench.stages
    remarks = ["", *(remark(*pair) for pair in pairwise(stages))]
    most = max(stage.over_noise for stage in stages)
    cells = Html("<tr><td>{}</td><td style='text-align:right'>{}</td>{}<td>{}</td></tr>")
    rows = html(
        *(
            cells.format(stage.label, over_noise(stage.over_noise), _bar(stage, most, note), note)
            for stage, note in zip(stages, remarks, strict=True)
        )
    )
    names = ", ".join(trial.name for trial in bench.untouched.trials)
    return html(
        Html('<table cellpadding="4" style="width:100%">{}</table>').format(rows),
        f"Error over sensor noise in short segments of {names}, which no model was fitted to; a perfect one has 1.",
        FOLDED.format("free runs of these trials, joint by joint", _free_runs(bench)),
    )


def over_noise(value: float) -> str:
    """Return the error over noise as it is shown everywhere."""
    return f"{value:.2f}"


def remark(before: ModelStage, after: ModelStage) -> str:
    """Return what has to be said of a stage that is no progress."""
    if after.over_noise > before.over_noise:
        return WORSE
    gained = 1.0 - (after.over_noise / before.over_noise) ** 2
    return NO_BETTER if gained < STANDARD.least_gain and after.label.startswith("+") else ""


def residual_test(compared: Comparison, joint: str) -> Html:
    """Return whether a joint's residual is noise, and which signals it follows."""
    white = next(one for one in compared.whiteness if one.joint == joint)
    lines = [
        f"white noise would be as correlated with p = {white.p_value:.2g}; its memory is {white.correlation_time:.3g} s"
    ]
    causes = [one for one in compared.cross_correlations if one.joint == joint][:CAUSES]
    lines += [
        f"{one.cause}: correlation {one.correlation:.2f}, {one.delay:.3f} s later, p {one.p_value:.2g}"
        for one in causes
    ]
    return FOLDED.format("residual test", listed(lines))


def _bar(stage: ModelStage, most: float, note: str) -> Html:
    return BAR.format(ORANGE if note or stage.label == BY_HAND else BLUE, 100.0 * stage.over_noise / max(most, 1e-9))


def _free_runs(bench: Workbench) -> Html:
    joints, units = bench.recording.joints, bench.recording.units

    def row(label: str, errors: dict[str, float]) -> Html:
        cells = (Html("<td style='text-align:right'>{}</td>").format(milli(errors[j], units[j])) for j in joints)
        return Html("<tr><td>{}</td>{}</tr>").format(label, html(*cells))

    floor = "noise floor" + ("" if bench.floor.source == "repeats" else " (guess: no repeats)")
    head = html(*(Html("<th>{}</th>").format(joint) for joint in joints))
    rows = html(*(row(stage.label, stage.errors.joints) for stage in bench.stages), row(floor, bench.floor.joints))
    return Html('<table cellpadding="4"><tr><th></th>{}</tr>{}</table>').format(head, rows)
