"""The page of the cases: a row each, a column for each setting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.mechanics.case import Setting
from benchmarks.mechanics.refinement import Refinement

_EXPLAINED = """What is expected follows from the normal forces that the simulation itself reports, so each figure
judges the law of contact and not the squeeze. The slip is read off a growing weight, to some 3 %. The cases
(`benchmarks/mechanics/`):

- creep: the published hand holds the cube at full weight; dry friction holds it without any creep. The way is given.
- twist: two tips pinch a box whose weight grows at a lever of 40 mm beside their axis, until it spins.
- slide_and_spin: the same at a lever of 3.3 mm, where sliding and spinning have equal shares of one limit surface.
- hanging: a box hangs below the axis of two tips and swings from 45 deg; spinning friction takes a part of the swing.
- impact: a smooth finger without torque hits a cube that floats; the impulse follows from both inertias.
"""


def mechanics_page(settings: Sequence[Setting], refinements: Sequence[Refinement], command: str) -> str:
    """Markdown.

    Args:
        settings: What was measured, of the same cases each.
        refinements: What changed in finer steps; may be none.
        command: What was typed.
    """
    head = ["case", "expected", *(setting.name for setting in settings)]
    rows = [_row(case, settings) for case in (settings[0].answers if settings else ())]
    cost = " | ".join(f"{setting.cost:.3f}" for setting in settings)
    return "\n".join(
        [
            "# Contact against mechanics",
            "",
            f"Command: `{command}`.",
            "Deviation from what mechanics says, for each engine and accuracy setting. docs/contact.md has the",
            "settings and the translation of contact into each engine.",
            "",
            f"| {' | '.join(head)} |",
            f"|{'---|' * len(head)}",
            *rows,
            f"| processor time [s] per simulated second, cube held | | {cost} |",
            "",
            _EXPLAINED,
            *(_refinement_table(refinements) if refinements else []),
        ]
    )


def _refinement_table(refinements: Sequence[Refinement]) -> list[str]:
    """What changes in finer steps, a row for each engine and spinning friction."""
    head = ["engine, spinning friction", "rest", "tip force", "twist", "gait: yaw", "tilt", "height"]
    return [
        "## Steps and iterations refined tenfold",
        "",
        "How far 0.2 ms and 300 iterations are from 2 ms and 30: a held cube after 10 s, its yaw after a scripted",
        "twist by 0.5 rad, a scripted gait of 6 s (largest change of the cube's yaw, tilt and height on the way; in",
        "brackets its yaw and tilt at the end in the finer steps).",
        "",
        f"| {' | '.join(head)} |",
        f"|{'---|' * len(head)}",
        *(_refinement_row(one) for one in refinements),
        "",
    ]


def _refinement_row(one: Refinement) -> str:
    coarse, fine = one.coarse, one.fine
    yaw, tilt, height = np.abs(coarse.gait - fine.gait).max(axis=0)
    cells = [
        f"{one.engine}, {1e3 * one.spinning:g} mm",
        f"{1e3 * np.linalg.norm(coarse.rest - fine.rest):.2f} mm",
        f"{np.abs(coarse.force - fine.force).max():.2f} N",
        f"{1e3 * abs(coarse.twist - fine.twist):.0f} mrad",
        f"{1e3 * yaw:.0f} mrad ({fine.gait[-1, 0]:+.2f} rad)",
        f"{1e3 * tilt:.0f} mrad ({fine.gait[-1, 1]:.2f} rad)",
        f"{1e3 * height:.1f} mm",
    ]
    return f"| {' | '.join(cells)} |"


def _row(case: str, settings: Sequence[Setting]) -> str:
    answers = [setting.answers[case] for setting in settings]
    first = answers[0]
    expected = [answer.expected for answer in answers]
    low, high = min(expected), max(expected)
    shown = f"{low:.3g}" if high - low < 0.005 * abs(high) or high == low else f"{low:.3g} to {high:.3g}"
    return f"| {case}: {first.quantity} | {shown} {first.unit} | {' | '.join(map(str, answers))} |"
