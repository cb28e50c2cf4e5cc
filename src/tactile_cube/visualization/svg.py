"""Drawings as SVG text, small enough to stand in a page that needs nothing else."""

import math
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MEASURED, SIMULATED, ERROR, FLOOR, FAILING = "#1b1f24", "#0969da", "#cf222e", "#57606a", "#ffebe9"
PALETTE = ("#0969da", "#bc4c00", "#1a7f37", "#8250df", "#bf3989", "#9a6700", "#1b7c83", "#57606a")
MOST_POINTS = 900  # of one line: as many as the eye can tell apart on a page


@dataclass(frozen=True)
class Line:
    """A curve: x and y (n,), its name in the legend, colour, width [px] and dash pattern."""

    name: str
    x: Array
    y: Array
    color: str = SIMULATED
    width: float = 1.5
    dash: str = ""


@dataclass(frozen=True)
class Band:
    """An area between `low` and `high` (n,) over x (n,)."""

    name: str
    x: Array
    low: Array
    high: Array
    color: str = SIMULATED


@dataclass(frozen=True)
class Axes:
    """The frame of a chart: size [px], labels, ranges and intervals of x that are marked."""

    x_label: str
    y_label: str
    width: int = 900
    height: int = 240
    marked: tuple[tuple[float, float], ...] = ()
    y_range: tuple[float, float] | None = None
    margin: tuple[int, int, int, int] = field(default=(26, 14, 40, 62))  # top, right, bottom, left

    @property
    def inner(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom of the drawing area [px]."""
        top, right, bottom, left = self.margin
        return left, top, self.width - right, self.height - bottom


def line_chart(axes: Axes, lines: list[Line], bands: list[Band] | None = None) -> str:
    """Curves and bands over one x axis, with ticks, grid, legend and marked intervals."""
    bands = bands or []
    xs = [one.x for one in lines] + [one.x for one in bands]
    ys = [one.y for one in lines] + [one.low for one in bands] + [one.high for one in bands]
    x_range = _range(xs, 0.0)
    y_range = axes.y_range or _range(ys, 0.06)
    to_x, to_y = _scale(x_range, axes.inner[0], axes.inner[2]), _scale(y_range, axes.inner[3], axes.inner[1])
    parts = [_marks(axes, to_x, x_range), _frame(axes, x_range, y_range, to_x, to_y)]
    parts += [_band(one, to_x, to_y) for one in bands]
    parts += [_polyline(one, to_x, to_y) for one in lines]
    named = [(one.name, one.color, one.dash, False) for one in lines] + [(b.name, b.color, "", True) for b in bands]
    parts.append(_legend(axes, [entry for entry in named if entry[0]]))
    return document(axes.width, axes.height, parts)


def document(width: int, height: int, parts: list[str]) -> str:
    """An SVG document that scales with the page."""
    body = "\n".join(part for part in parts if part)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        f'font-family="system-ui, sans-serif" font-size="12">\n{body}\n</svg>'
    )


def text(x: float, y: float, content: str, anchor: str = "start", color: str = "#57606a", extra: str = "") -> str:
    """A piece of text at (x, y) [px]."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}" {extra}>{escape(content)}</text>'


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers between `low` and `high`."""
    raw = (high - low) / count
    magnitude = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * magnitude for factor in (1, 2, 2.5, 5, 10) if factor * magnitude >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [round(k * step, 12) for k in range(first, math.floor(high / step + 1e-9) + 1)]


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """Points that keep every peak, smallest and largest of each interval, and every gap: a missing sample within it.

    At most `MOST_POINTS` of them, and one more for each interval that holds a gap.
    """
    if len(x) <= MOST_POINTS:
        return x, y
    edges = np.linspace(0, len(x), MOST_POINTS // 2 + 1).astype(int)
    chosen = sorted(a + one for a, b in pairwise(edges) for one in _telling(y[a:b]))
    return x[chosen], y[chosen]


def _telling(piece: Array) -> set[int]:
    """Indices of the smallest and the largest of some samples, and of the first that is missing."""
    there = np.isfinite(piece)
    telling = set() if there.all() else {int(np.argmin(there))}
    if there.any():
        telling |= {int(np.nanargmin(piece)), int(np.nanargmax(piece))}
    return telling


def _range(arrays: list[Array], slack: float) -> tuple[float, float]:
    low = min(float(np.nanmin(one)) for one in arrays)
    high = max(float(np.nanmax(one)) for one in arrays)
    if high - low < 1e-12:
        low, high = low - 0.5, high + 0.5
    return low - slack * (high - low), high + slack * (high - low)


@dataclass(frozen=True)
class _scale:  # noqa: N801 - used as a function
    values: tuple[float, float]
    start: float
    end: float

    def __call__(self, value: float) -> float:
        low, high = self.values
        return self.start + (value - low) / (high - low) * (self.end - self.start)


def _frame(axes: Axes, xr: tuple[float, float], yr: tuple[float, float], to_x: _scale, to_y: _scale) -> str:
    left, top, right, bottom = axes.inner
    parts = []
    for value in ticks(*xr, count=8):
        parts.append(f'<line x1="{to_x(value):.1f}" x2="{to_x(value):.1f}" y1="{top}" y2="{bottom}" stroke="#eaeef2"/>')
        parts.append(text(to_x(value), bottom + 16, f"{value:g}", "middle"))
    for value in ticks(*yr, count=4):
        parts.append(f'<line x1="{left}" x2="{right}" y1="{to_y(value):.1f}" y2="{to_y(value):.1f}" stroke="#eaeef2"/>')
        parts.append(text(left - 6, to_y(value) + 4, f"{value:g}", "end"))
    parts.append(
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" fill="none" stroke="#d0d7de"/>'
    )
    parts.append(text((left + right) / 2, axes.height - 6, axes.x_label, "middle"))
    middle = (top + bottom) / 2
    parts.append(text(14, middle, axes.y_label, "middle", extra=f'transform="rotate(-90 14 {middle:.1f})"'))
    return "\n".join(parts)


def _marks(axes: Axes, to_x: _scale, x_range: tuple[float, float]) -> str:
    _, top, _, bottom = axes.inner
    rectangles = []
    for start, end in axes.marked:
        a, b = to_x(max(start, x_range[0])), to_x(min(end, x_range[1]))
        if b > a:
            rectangles.append(
                f'<rect x="{a:.1f}" y="{top}" width="{b - a:.1f}" height="{bottom - top}" fill="{FAILING}"/>'
            )
    return "\n".join(rectangles)


def _polyline(line: Line, to_x: _scale, to_y: _scale) -> str:
    x, y = thinned(line.x, line.y)
    pieces, pen = [], "M"
    for a, b in zip(x, y, strict=True):
        if np.isfinite(b):
            pieces.append(f"{pen}{to_x(a):.1f} {to_y(b):.1f}")
            pen = "L"
        else:
            pen = "M"
    dash = f' stroke-dasharray="{line.dash}"' if line.dash else ""
    return f'<path d="{"".join(pieces)}" fill="none" stroke="{line.color}" stroke-width="{line.width}"{dash}/>'


def _band(band: Band, to_x: _scale, to_y: _scale) -> str:
    step = max(1, len(band.x) // (MOST_POINTS // 2))
    x, low, high = band.x[::step], band.low[::step], band.high[::step]
    forth = "L".join(f"{to_x(a):.1f} {to_y(b):.1f}" for a, b in zip(x, high, strict=True))
    back = "L".join(f"{to_x(a):.1f} {to_y(b):.1f}" for a, b in zip(x[::-1], low[::-1], strict=True))
    return f'<path d="M{forth}L{back}Z" fill="{band.color}" fill-opacity="0.18" stroke="none"/>'


def _legend(axes: Axes, entries: list[tuple[str, str, str, bool]]) -> str:
    parts, x = [], float(axes.inner[0])
    for name, color, dash, area in entries:
        pattern = f' stroke-dasharray="{dash}"' if dash else ""
        width, opacity = (9, 0.25) if area else (2.5, 1)
        parts.append(f'<line x1="{x}" x2="{x + 20}" y1="12" y2="12" stroke="{color}" stroke-width="{width}" '
                     f'stroke-opacity="{opacity}"{pattern}/>')  # fmt: skip
        parts.append(text(x + 25, 16, name, color="#1b1f24"))
        x += 25 + 7.0 * len(name) + 22
    return "\n".join(parts)
