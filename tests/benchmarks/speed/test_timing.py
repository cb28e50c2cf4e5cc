"""Timing in turns."""

from benchmarks.speed.timing import Timing, in_turns


def test_each_case_is_called_once_uncounted_and_then_in_turns() -> None:
    order: list[str] = []
    timings = in_turns({"a": lambda: order.append("a"), "b": lambda: order.append("b")}, rounds=2, calls=2)
    assert "".join(order) == "ab" + 2 * "aabb"
    assert all(len(timing.cpu) == len(timing.wall) == 2 for timing in timings.values())


def test_quartiles_are_of_the_processor_time() -> None:
    assert Timing(cpu=[4.0, 1.0, 2.0, 3.0, 5.0], wall=[9.0] * 5).quartiles == (2.0, 3.0, 4.0)
