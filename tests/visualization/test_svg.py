import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from tactile_cube.visualization.svg import MOST_POINTS, Axes, Band, Line, line_chart, thinned, ticks
from tactile_cube.visualization.svg_tables import Interval, bar_chart, heat_map, interval_chart


def test_a_chart_is_valid_xml_and_escapes_its_texts() -> None:
    x = np.linspace(0, 1, 50)
    svg = line_chart(Axes("time [s]", "a < b & c"), [Line("<measured>", x, x**2)], [Band("band", x, x - 0.1, x + 0.1)])
    assert ElementTree.fromstring(svg).tag.endswith("svg")
    assert "&lt;measured&gt;" in svg


def test_a_curve_stays_inside_the_frame() -> None:
    x = np.linspace(0, 10, 400)
    axes = Axes("x", "y")
    svg = line_chart(axes, [Line("l", x, np.sin(x) * 1e-3)])
    path = re.search(r'<path d="([^"]+)" fill="none"', svg)
    assert path is not None
    points = np.array([point.split() for point in re.split("[ML]", path[1])[1:]], dtype=float)
    left, top, right, bottom = axes.inner
    assert points[:, 0].min() >= left - 0.1
    assert points[:, 0].max() <= right + 0.1
    assert points[:, 1].min() >= top
    assert points[:, 1].max() <= bottom


def test_thinning_keeps_every_peak() -> None:
    y = np.zeros(100_000)
    y[12_345], y[77_777] = 5.0, -3.0
    x, thin = thinned(np.arange(100_000.0), y)
    assert len(x) <= MOST_POINTS
    assert (thin.max(), thin.min()) == (5.0, -3.0)


@pytest.mark.parametrize("samples", [50, 100_000])
@pytest.mark.parametrize("gap", [(0.4, 0.4), (0.3, 0.6), (0.3, 0.302)])
def test_missing_samples_interrupt_the_line_of_a_long_recording_too(samples: int, gap: tuple[float, float]) -> None:
    x = np.linspace(0.0, 1.0, samples)
    first, last = (int(share * samples) for share in gap)
    y = np.sin(40.0 * x)
    y[first : last + 1] = np.nan
    axes = Axes("x", "y")
    svg = line_chart(axes, [Line("l", x, y)])
    path = re.search(r'<path d="([^"]+)" fill="none"', svg)
    assert path is not None
    ends = [piece.split("L") for piece in path[1].split("M")[1:]]
    assert len(ends) == 2
    left, _, right, _ = axes.inner
    drawn = [(float(point.split()[0]) - left) / (right - left) for point in (ends[0][-1], ends[1][0])]
    assert drawn == pytest.approx([x[first - 1], x[last + 1]], abs=2 / MOST_POINTS + 1e-4)
    assert "nan" not in svg


@pytest.mark.parametrize(("low", "high"), [(0, 1), (-3e-4, 2e-4), (0, 1234), (5.0, 5.1)])
def test_ticks_are_few_round_and_inside(low: float, high: float) -> None:
    values = ticks(low, high)
    assert 2 <= len(values) <= 9
    assert all(low - 1e-12 <= value <= high + 1e-12 for value in values)


def test_a_constant_signal_can_be_drawn() -> None:
    svg = line_chart(Axes("x", "y"), [Line("l", np.arange(5.0), np.zeros(5))])
    ElementTree.fromstring(svg)
    assert "nan" not in svg
    assert "inf" not in svg


def test_tables_are_valid_xml() -> None:
    bars = bar_chart([("nominal", 7.0), ("refitted", 0.6)], "mrad", 0.5)
    cells = heat_map(["q1"], ["slow", "fast"], [[1.0, None]])
    intervals = interval_chart([Interval("excess", 0.08, 0.07, 0.09, "N m", 0.0)])
    for svg, words in ((bars, ("nominal", "refitted")), (cells, ("slow", "fast", "q1")), (intervals, ("excess",))):
        text = "".join(ElementTree.fromstring(svg).itertext())
        assert all(word in text for word in words)


def test_bars_are_as_long_as_their_values() -> None:
    svg = bar_chart([("a", 2.0), ("b", 1.0)], "mrad")
    widths = [float(width) for width in re.findall(r'<rect [^>]*width="([\d.]+)"', svg)]
    assert widths[0] == pytest.approx(2 * widths[1], rel=0.01)
