"""Timing in turns."""

from collections import Counter

from benchmarks.speed.timing import Timing, in_turns


def test_each_case_is_called_once_uncounted_and_then_in_every_round() -> None:
    calls: Counter[str] = Counter()
    cases = {name: lambda name=name: calls.update([name]) for name in ("ours", "theirs")}
    timings = in_turns(cases, rounds=3, calls=2)
    assert calls == {"ours": 7, "theirs": 7}
    assert all(len(timing.cpu) == len(timing.wall) == 3 for timing in timings.values())


def test_cases_take_turns() -> None:
    order: list[str] = []
    in_turns({"a": lambda: order.append("a"), "b": lambda: order.append("b")}, rounds=2, calls=1)
    assert "".join(order) == "ababab"


def test_quartiles_are_of_the_processor_time() -> None:
    assert Timing(cpu=[4.0, 1.0, 2.0, 3.0, 5.0], wall=[9.0] * 5).quartiles == (2.0, 3.0, 4.0)
