import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from tactile_cube.visualization.charts import WIDTH, bar_chart, heat_map, interval_chart, svg, time_chart

INK = "#123456"


def drawn(x: np.ndarray, y: np.ndarray) -> list[np.ndarray]:
    """The unbroken pieces of a curve in a chart, points (n, 2) [px]."""
    axes = time_chart("y")
    axes.plot(x, y, color=INK)
    (path,) = re.findall(rf' d="([^"]+)"[^>]*stroke: {INK}', svg(axes))
    return [np.array([point.split() for point in piece.split("L")], dtype=float) for piece in path.split("M")[1:]]


def test_texts_are_text_and_escaped_and_ids_are_those_that_are_referred_to() -> None:
    axes = time_chart("a < b & c")
    axes.plot([0, 1], [0, 1], label="<measured>")
    chart = svg(axes)
    assert {"a < b & c", "<measured>", "time [s]"} <= {
        text.strip() for text in ElementTree.fromstring(chart).itertext()
    }
    assert set(re.findall(r'\bid="([^"]+)"', chart)) == set(re.findall(r"url\(#([^)]+)\)", chart))


def test_a_long_noisy_curve_is_drawn_with_few_points_and_every_peak() -> None:
    y = np.random.default_rng(0).normal(size=200_000)
    y[12_345], y[150_000] = 50.0, -30.0
    (points,) = drawn(np.arange(200_000.0), y)
    assert len(points) < 4 * WIDTH
    heights = np.sort(points[:, 1])
    assert heights[1] - heights[0] == pytest.approx((50 - np.sort(y)[-2]) / 80 * (heights[-1] - heights[0]), abs=1)


@pytest.mark.parametrize("samples", [50, 100_000])
@pytest.mark.parametrize("gap", [(0.4, 0.4), (0.3, 0.6), (0.3, 0.302)])
def test_missing_samples_interrupt_the_line_of_a_long_recording_too(samples: int, gap: tuple[float, float]) -> None:
    x = np.linspace(0.0, 1.0, samples)
    first, last = (int(share * samples) for share in gap)
    y = np.sin(40.0 * x)
    y[first : last + 1] = np.nan
    before, after = drawn(x, y)
    shares = (np.array([before[-1, 0], after[0, 0]]) - before[0, 0]) / (after[-1, 0] - before[0, 0])
    assert shares == pytest.approx([x[first - 1], x[last + 1]], abs=3e-3)


def test_tables_hold_their_names_and_numbers() -> None:
    bars = bar_chart([("nominal", 7.0), ("refitted", 0.6)], "mrad", 0.5)
    cells = heat_map(["q1"], ["slow", "fast"], [[123.4, None]])
    intervals = interval_chart([("excess", 0.08, 0.07, 0.09, "N m"), ("fixed", 1, 1, 1, "s")])
    words = {bars: ["nominal", "refitted", "7 mrad", "noise floor 0.5 mrad"], cells: ["slow", "fast", "q1", "123"]}
    words[intervals] = ["excess", "0.08 N m [0.07, 0.09]", "fixed", "1 s [1, 1]"]
    for chart, expected in words.items():
        assert set(expected) <= {text.strip() for text in ElementTree.fromstring(chart).itertext()}
        assert "nan" not in chart


def test_bars_are_as_long_as_their_values() -> None:
    paths = re.findall(
        r' d="M ([\d.]+) [\d.]+L ([\d.]+)[^"]*"[^>]*fill: #0072b2', bar_chart([("a", 2), ("b", 1)], "mrad")
    )
    first, second = (float(right) - float(left) for left, right in paths)
    assert first == pytest.approx(2 * second, rel=0.01)
