"""Rates and ratios, and their tables."""

from benchmarks.speed.report import Growth, Section, durations, rates, table
from benchmarks.speed.timing import Timing

TIMINGS = {"ours": Timing(cpu=[0.1, 0.2, 0.3]), "peer": Timing(cpu=[0.4, 0.4, 0.4])}


def section() -> Section:
    made = Section("update", "one update", "peer", rates(TIMINGS, "peer", "updates/s", {"ours": "bf16"}))
    made.growth = [Growth("against batch", "batch", [64.0, 256.0], "time [ms]", [9.0, 15.25])]
    made.missing = ["mujoco: not installed (pip install mujoco)"]
    return made


def test_rates_are_calls_a_second_and_above_one_where_ours_is_faster() -> None:
    ours, peer = rates(TIMINGS, "peer", "updates/s")
    assert (ours.value, ours.ratio) == (5.0, 2.0)
    assert ours.low < ours.value < ours.high
    assert (peer.value, peer.ratio) == (2.5, 1.0)


def test_durations_are_milliseconds_with_quartiles_in_order() -> None:
    ours = durations(TIMINGS)[0]
    assert (ours.value, ours.unit) == (200.0, "CPU ms")
    assert ours.low < ours.value < ours.high


def test_the_table_shows_figures_curves_and_what_is_missing() -> None:
    text = table(section())
    assert "| ours | 5.00" in text or "| ours | 5 " in text
    assert "ratio to peer" in text
    assert "2.00" in text
    assert "| batch     | 64 | 256  |" in text
    assert "not installed (pip install mujoco)" in text
    widths = {len(line) for line in text.splitlines() if "updates/s" in line}
    assert len(widths) == 1
