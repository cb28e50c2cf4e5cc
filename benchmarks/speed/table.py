"""A section as a table on the terminal or a page."""

from __future__ import annotations

from benchmarks.speed.report import Figure, Growth, Section


def table(section: Section) -> str:
    """Title, one row a figure with median and quartiles, curves, and what is missing, as Markdown."""
    lines = [f"## {section.name}: {section.title}", ""]
    if section.figures:
        lines += _aligned([_head(section), *(_row(figure) for figure in section.figures)])
    for growth in section.growth:
        lines += ["", *_aligned(_growth_rows(growth))]
    lines += [f"\n{note}" for note in section.missing]
    return "\n".join([*lines, "", f"({section.seconds:.0f} s)"])


def _head(section: Section) -> list[str]:
    ratio = f"ratio to {section.yardstick}" if any(figure.ratio for figure in section.figures) else ""
    return ["", "median", "quartiles", "unit", ratio, "note"]


def _row(figure: Figure) -> list[str]:
    ratio = "" if figure.ratio is None else f"{figure.ratio:.2f}"
    quartiles = f"{_short(figure.low)} .. {_short(figure.high)}"
    return [figure.name, _short(figure.value), quartiles, figure.unit, ratio, figure.note]


def _growth_rows(growth: Growth) -> list[list[str]]:
    return [[growth.x_name, *(f"{x:g}" for x in growth.x)], [growth.y_name, *(_short(y) for y in growth.y)]]


def _short(value: float) -> str:
    """Three digits that count."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def _aligned(rows: list[list[str]]) -> list[str]:
    """Rows as a Markdown table whose columns line up; columns with a head alone are left out."""
    kept = [column for column in zip(*rows, strict=True) if any(column[1:])]
    widths = [max(len(cell) for cell in column) for column in kept]
    texts = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |"
        for row in zip(*kept, strict=True)
    ]
    return [texts[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *texts[1:]]
