"""The page of the cases: a row each, a column for each setting."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_cube.simulation.mechanics.settings import Setting

_EXPLAINED = """What is expected follows from the normal forces that the simulation itself reports, so each figure
judges the law of contact and not the squeeze. The slip is read off a growing weight, to some 3 %. The cases
(`src/tactile_cube/simulation/mechanics/`):

- creep: the published hand holds the cube at full weight; dry friction holds it without any creep. The way is given.
- twist: two tips pinch a box whose weight grows at a lever of 40 mm beside their axis, until it spins.
- slide_and_spin: the same at a lever of 3.3 mm, where sliding and spinning have equal shares of one limit surface.
- hanging: a box hangs below the axis of two tips and swings from 45 deg; spinning friction takes a part of the swing.
- impact: a smooth finger without torque hits a cube that floats; the impulse follows from both inertias.
"""


def mechanics_page(settings: Sequence[Setting], command: str) -> str:
    """Markdown.

    Args:
        settings: What was measured, of the same cases each.
        command: What was typed.
    """
    head = ["case", "expected", *(setting.name for setting in settings)]
    rows = [_row(case, settings) for case in settings[0].answers]
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
        ]
    )


def _row(case: str, settings: Sequence[Setting]) -> str:
    answers = [setting.answers[case] for setting in settings]
    first = answers[0]
    expected = [answer.expected for answer in answers]
    low, high = min(expected), max(expected)
    shown = f"{low:.3g}" if high - low < 0.005 * abs(high) or high == low else f"{low:.3g} to {high:.3g}"
    return f"| {case}: {first.quantity} | {shown} {first.unit} | {' | '.join(map(str, answers))} |"
