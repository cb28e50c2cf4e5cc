"""Drawings of tables: bars with a floor, a heat map, values with their intervals."""

import math
from dataclasses import dataclass

from tactile_cube.visualization.svg import FLOOR, PALETTE, document, text, ticks

ROW = 26


@dataclass(frozen=True)
class Interval:
    """A value with its interval; `neutral` is where it would change nothing."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    neutral: float | None = None


def bar_chart(
    bars: list[tuple[str, float]], unit: str, floor: float | None = None, floor_name: str = "noise floor"
) -> str:
    """Horizontal bars with their numbers; a dashed line marks the floor."""
    left, width = 230, 900
    most = max([value for _, value in bars] + [floor or 0.0]) or 1.0
    height = ROW * len(bars) + 34
    scale = (width - left - 110) / most
    parts = []
    for row, (name, value) in enumerate(bars):
        y = row * ROW + 6
        parts.append(text(left - 8, y + 14, name, "end", "#1b1f24"))
        parts.append(f'<rect x="{left}" y="{y}" width="{max(1.0, value * scale):.1f}" height="{ROW - 8}" rx="2" '
                     f'fill="{PALETTE[0]}" fill-opacity="0.8"/>')  # fmt: skip
        parts.append(text(left + value * scale + 6, y + 14, f"{value:.3g} {unit}", color="#1b1f24"))
    if floor is not None:
        x, bottom = left + floor * scale, ROW * len(bars) + 4
        parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{bottom}" stroke="{FLOOR}" stroke-width="1.5" '
                     'stroke-dasharray="5 3"/>')  # fmt: skip
        parts.append(text(x, bottom + 16, f"{floor_name} {floor:.2g} {unit}", "middle" if x > left + 60 else "start"))
    return document(width, height, parts)


def heat_map(rows: list[str], columns: list[str], values: list[list[float | None]], most: float = 6.0) -> str:
    """Ratios on a background that reddens with their logarithm, from 1 to the largest or `most`; None stays empty."""
    left, top, right, width = 90, 150, 90, 900
    cell = min(74.0, (width - left - right) / max(1, len(columns)))
    hottest = max([most] + [value for row in values for value in row if value is not None])
    parts = []
    for index, name in enumerate(columns):
        x = left + (index + 0.5) * cell + 4
        parts.append(text(x, top - 8, name, "start", "#1b1f24", f'transform="rotate(-42 {x:.1f} {top - 8})"'))
    for row, name in enumerate(rows):
        y = top + row * ROW
        parts.append(text(left - 8, y + 17, name, "end", "#1b1f24"))
        parts += [_cell(left + i * cell, y, cell, value, hottest) for i, value in enumerate(values[row])]
    return document(width, top + ROW * len(rows) + 8, parts)


def _cell(x: float, y: float, width: float, value: float | None, hottest: float) -> str:
    if value is None:
        return ""
    heat = max(0.0, math.log(max(value, 1e-9)) / math.log(hottest))
    fill = f"rgb({255 - int(48 * heat)},{250 - int(190 * heat)},{248 - int(190 * heat)})"
    box = f'<rect x="{x + 1:.1f}" y="{y + 1}" width="{width - 2:.1f}" height="{ROW - 2}" rx="2" fill="{fill}"/>'
    shown = f"{value:.1f}" if value < 99.5 else f"{value:.0f}"
    return box + text(x + width / 2, y + 17, shown, "middle", "#ffffff" if heat > 0.6 else "#1b1f24")


def interval_chart(intervals: list[Interval]) -> str:
    """One row a value, each on an axis of its own: the interval as a bar, the value as a dot, the neutral as a tick."""
    left, right, width = 330, 650, 900
    parts = []
    for row, one in enumerate(intervals):
        y = row * ROW + 16
        known = [one.low, one.high, one.value] + ([one.neutral] if one.neutral is not None else [])
        low, high = min(known), max(known)
        slack = 0.08 * (high - low) or 1.0
        scale = (right - left) / (high - low + 2 * slack)
        place = {
            key: left + (value - low + slack) * scale for key, value in vars(one).items() if isinstance(value, float)
        }
        parts.append(text(left - 12, y + 4, one.name, "end", "#1b1f24"))
        parts.append(f'<line x1="{left}" x2="{right}" y1="{y}" y2="{y}" stroke="#eaeef2"/>')
        if "neutral" in place:
            x = place["neutral"]
            parts.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y - 8}" y2="{y + 8}" stroke="{FLOOR}" stroke-width="2"/>'
            )
        parts.append(f'<line x1="{place["low"]:.1f}" x2="{place["high"]:.1f}" y1="{y}" y2="{y}" stroke="{PALETTE[0]}" '
                     'stroke-width="7" stroke-opacity="0.35"/>')  # fmt: skip
        parts.append(f'<circle cx="{place["value"]:.1f}" cy="{y}" r="4.5" fill="{PALETTE[0]}"/>')
        label = f"{one.value:.4g} {one.unit} [{one.low:.4g}, {one.high:.4g}]"
        parts.append(text(right + 14, y + 4, label, color="#1b1f24"))
    return document(width, ROW * len(intervals) + 12, parts)


__all__ = ["Interval", "bar_chart", "heat_map", "interval_chart", "ticks"]
