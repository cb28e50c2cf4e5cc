"""The control loop on fingers that follow at once: homing, 10 Hz, limits, and everything that stops it."""

from collections.abc import Callable

import numpy as np
import pytest

from tactile_cube.deployment.control_loop import ControlLoop, Homing, Mode
from tactile_cube.deployment.limits import Limits
from tactile_cube.deployment.played_targets import PlayedTargets
from tactile_cube.deployment.robot import Reading
from tactile_cube.deployment.stop_rules import StopRules, Watchdog
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2

HOME = np.asarray(DLR_HAND2.start_angles)
LIMITS = Limits(DLR_HAND2.lower, DLR_HAND2.upper, 6.28, 1.0, np.full(12, 3.69), np.full(12, 0.25))
QUICK = Homing(speed=1.0, settle=0.05)


class Counting(PlayedTargets):
    """Notes what it is asked with."""

    def __init__(self, targets: np.ndarray) -> None:
        super().__init__(targets)
        self.asked: list[tuple[np.ndarray, np.ndarray]] = []

    def step(self, q_m: np.ndarray, q_f: np.ndarray) -> np.ndarray:
        self.asked.append((np.array(q_m), np.array(q_f)))
        return super().step(q_m, q_f)


def loop_of(targets: np.ndarray, seconds: float = 1.0, rules: StopRules | None = None) -> tuple[ControlLoop, Counting]:
    decides = Counting(targets)
    return ControlLoop(decides, 0.2, LIMITS, rules or StopRules(), QUICK, seconds), decides


def run(loop: ControlLoop, ticks: int, follow: Callable[[float, np.ndarray], Reading | None]) -> list[np.ndarray]:
    """Ticks of 1 ms; `follow` says what is measured at a time, given what was sent last."""
    sent = [HOME - 0.1]
    for tick in range(ticks):
        now = 1e-3 * tick
        command = loop.tick(now, follow(now, sent[-1]))
        if command is not None:
            sent.append(np.array(command))
    return sent


def following(now: float, q_d: np.ndarray) -> Reading:
    return Reading(now, np.array(q_d), np.zeros(12))


def test_it_homes_then_asks_at_10_hz_then_stops_when_time_is_over() -> None:
    loop, decides = loop_of(np.tile(HOME + 0.05, (20, 1)))
    sent = run(loop, 1400, following)
    assert (loop.mode, loop.reason) == (Mode.STOPPED, "time is over")
    assert len(decides.asked) == 10
    np.testing.assert_allclose(decides.asked[0][0], HOME, atol=1e-9)
    np.testing.assert_allclose(decides.asked[0][1], decides.asked[0][0], atol=1e-9)  # q_f starts where the fingers are
    expected = HOME + 0.05 * (1.0 - np.exp(-1.0 / 0.2))
    np.testing.assert_allclose(sent[-1], expected, atol=1e-3)
    steps = np.abs(np.diff(np.array(sent), axis=0))
    assert steps.max() < 1.01e-3  # homing at 1 rad/s, the filter is slower


def test_nothing_is_sent_before_the_first_measurement() -> None:
    loop, _ = loop_of(HOME[None])
    assert loop.tick(0.0, None) is None
    assert loop.mode is Mode.WAITING


def test_homing_that_gets_nowhere_stops() -> None:
    loop, decides = loop_of(HOME[None])
    run(loop, 11_000, lambda now, q_d: Reading(now, HOME - 0.1, np.zeros(12)))
    assert loop.reason.startswith("homing: still 0.10 rad from the start angles")
    assert decides.asked == []


def spoilt(from_time: float, change: Callable[[Reading], Reading | None]) -> Callable[..., Reading | None]:
    """Fingers that follow, until something happens."""
    return lambda now, q_d: following(now, q_d) if now < from_time else change(following(now, q_d))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda r: None, "no measurement for 2"),
        (lambda r: Reading(r.time, np.full(12, np.nan), r.dq), "not a number"),
        (lambda r: Reading(r.time, r.q_m, np.full(12, 7.0)), "7.0 rad/s, allowed 6.28 rad/s"),
        (lambda r: Reading(r.time, r.q_m + np.eye(12)[3] * 3.0, r.dq), "middle_q1: "),
        (lambda r: Reading(r.time, HOME - 0.29, r.dq), "all its torque for 1 s"),
    ],
)
def test_every_stop_rule_stops_and_holds(change: Callable[[Reading], Reading | None], reason: str) -> None:
    loop, _ = loop_of(np.tile(HOME, (60, 1)), seconds=5.0)
    sent = run(loop, 1900, spoilt(0.5, change))
    assert loop.mode is Mode.STOPPED
    assert reason in loop.reason
    assert np.isfinite(sent[-1]).all()
    assert np.array_equal(sent[-1], sent[-2])


def test_a_measurement_that_is_lost_now_and_then_stops_nothing() -> None:
    loop, _ = loop_of(np.tile(HOME, (20, 1)))
    run(loop, 1400, lambda now, q_d: None if round(1e3 * now) % 10 < 5 and now > 0 else following(now, q_d))
    assert loop.reason == "time is over"


def test_only_torque_that_lasts_without_a_break_stops() -> None:
    watchdog = Watchdog(StopRules(saturation=1.0), DLR_HAND2.lower, DLR_HAND2.upper, DLR_HAND2.joint_names)
    saturated = np.ones(12, dtype=bool)
    for tick in range(2500):
        reading = Reading(1e-3 * tick, HOME, np.zeros(12))
        assert watchdog.judge(1e-3 * tick, 1e-3, reading, saturated & (tick % 800 != 0)) == ""


def test_a_late_tick_stops() -> None:
    loop, _ = loop_of(np.tile(HOME, (20, 1)))
    run(loop, 500, following)
    loop.tick(0.6, following(0.6, HOME))
    assert loop.reason.startswith("tick 101 ms after the one before, allowed 20 ms")


def test_limits_bound_range_rate_and_torque() -> None:
    rest = np.zeros(12)
    beyond = LIMITS.apply(HOME, np.full(12, 9.0), HOME, rest, dt=10.0)
    assert (beyond <= HOME + 1.0 / 3.69 + 1e-12).all()
    slow = LIMITS.apply(HOME, HOME + 0.2, HOME, rest, dt=1e-3)
    np.testing.assert_allclose(slow - HOME, 6.28e-3)
    at_goal = LIMITS.apply(HOME, HOME + 9.0, HOME + 9.0, rest, dt=10.0)
    assert (at_goal <= np.maximum(DLR_HAND2.upper, HOME + 9.0 - 1.0 / 3.69)).all()


def test_bounds_without_a_meaning_are_refused() -> None:
    with pytest.raises(InputError, match=r"stop\.silence is 0"):
        StopRules(silence=0.0)
