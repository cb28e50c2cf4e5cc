"""Figures of a section of the benchmark, and their table."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from benchmarks.speed.timing import Timing


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        name: what was measured.
        value: the median.
        low: lower quartile.
        high: upper quartile.
        unit: of all three.
        ratio: to the section's yardstick, above 1 where this one is better; None where the yardstick is missing.
        note: what one should know about it.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    ratio: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Growth:
    """How a number grows with another.

    Attributes:
        name: of the curve.
        x_name: what is varied.
        x: its values.
        y_name: what is measured, with unit.
        y: its values.
    """

    name: str
    x_name: str
    x: list[float]
    y_name: str
    y: list[float]


@dataclass
class Section:
    """A group of figures on the same work.

    Attributes:
        name: as on the command line.
        title: the work in words.
        yardstick: name of the figure that ratios refer to, "" for none.
        figures: what was measured.
        growth: how costs grow.
        missing: peers that are not there, each with the command that installs it.
        seconds: time the section took on the clock [s].
    """

    name: str
    title: str
    yardstick: str = ""
    figures: list[Figure] = field(default_factory=list)
    growth: list[Growth] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def plain(self) -> dict[str, Any]:
        """As JSON takes it."""
        return asdict(self)


def rates(timings: dict[str, Timing], yardstick: str, unit: str, notes: dict[str, str] | None = None) -> list[Figure]:
    """Calls a second of processor time, and their ratio to the yardstick where that was measured.

    Args:
        timings: by name.
        yardstick: name of the timing that ratios refer to.
        unit: of the rate, e.g. "steps/s".
        notes: by name.
    """
    base = timings[yardstick].quartiles[1] if yardstick in timings else None
    figures = []
    for name, timing in timings.items():
        low, median, high = timing.quartiles
        ratio = None if base is None else base / median
        figures.append(Figure(name, 1.0 / median, 1.0 / high, 1.0 / low, unit, ratio, (notes or {}).get(name, "")))
    return figures


def durations(timings: dict[str, Timing]) -> list[Figure]:
    """Processor time a call [ms]."""
    milliseconds = {name: [1e3 * seconds for seconds in timing.quartiles] for name, timing in timings.items()}
    return [Figure(name, median, low, high, "CPU ms") for name, (low, median, high) in milliseconds.items()]


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
