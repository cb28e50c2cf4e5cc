"""The control loop on joints that follow: its modes, what stops it, and attacks on a robot by one number."""

import os
import subprocess
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

from tactile_cube.deployment.command_guard import CommandGuard
from tactile_cube.deployment.control_loop import ControlLoop, Homing, Mode
from tactile_cube.deployment.controller import PlayedTargets
from tactile_cube.deployment.robot import JointLimits, Reading, StopRules, Watchdog
from tactile_cube.deployment.run_loop import CHUNK, LoopLog, LoopRun, write_runs
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tactile_cube.measurement.recordings import writing
from tactile_cube.measurement.recordings.reading import read_recording
from tests.deployment.following_robot import FollowingRobot, Spoil, change, clock, drive, raising

HOME = np.asarray(DLR_HAND2.start_angles)
OPEN = HOME - 0.1
LIMITS = JointLimits(DLR_HAND2.lower, DLR_HAND2.upper, 6.28, 1.0, np.full(12, 3.69), np.full(12, 0.25))
RULES = StopRules()
QUICK = Homing(speed=1.0, settle=0.05)
FIRST = 2  # the tick of the first measurement
RUNNING = 200  # a tick at which the policy decides
AT = np.eye(12)[4]  # middle_q2


class Counting(PlayedTargets):
    """Notes what it is asked with."""

    def __init__(self, targets: np.ndarray) -> None:
        super().__init__(targets)
        self.asked: list[tuple[np.ndarray, np.ndarray]] = []

    def reset(self) -> None:
        super().reset()
        self.asked = []

    def step(self, q_m: np.ndarray, q_f: np.ndarray) -> np.ndarray:
        self.asked.append((np.array(q_m), np.array(q_f)))
        return super().step(q_m, q_f)


def run(
    robot: FollowingRobot,
    targets: np.ndarray = HOME[None] + 0.2,
    seconds: float = 0.5,
    opened: np.ndarray | None = None,
    limits: JointLimits = LIMITS,
    say: Callable[[str], None] = lambda line: None,
    log: LoopLog | None = None,
) -> LoopRun:
    """Run a loop on a robot; see `drive`."""
    robot.loop = ControlLoop(Counting(targets), 0.2, limits, RULES, QUICK, seconds, opened=opened, clock=robot.clock)
    return drive(robot, limits, RULES, say, log)


# --- modes -----------------------------------------------------------------------------------------------------------


def test_it_homes_then_asks_at_10_hz_then_stops_when_time_is_over() -> None:
    robot = FollowingRobot(HOME - 0.1)
    assert run(robot, np.tile(HOME + 0.05, (20, 1)), seconds=1.0).reason == "time is over"
    asked = robot.loop._decides.asked  # type: ignore[attr-defined]
    assert len(asked) == 10
    np.testing.assert_allclose(asked[0][0], HOME, atol=1e-9)
    np.testing.assert_allclose(asked[0][1], asked[0][0], atol=1e-9)  # q_f starts where the fingers are
    np.testing.assert_allclose(robot.q, HOME + 0.05 * (1.0 - np.exp(-1.0 / 0.2)), atol=1e-3)
    steps = np.abs(np.diff([one.q_d for one in robot.sent], axis=0))
    assert steps.max() < 1.01e-3  # homing at 1 rad/s, the filter is slower


def test_open_fingers_hold_position_until_the_object_is_confirmed_then_close_then_the_policy_decides() -> None:
    lines: list[str] = []
    robot = FollowingRobot(HOME)
    robot.confirms = False
    robot.in_read[1000].append(lambda robot: setattr(robot, "confirms", True))
    run(robot, opened=OPEN, say=lines.append)
    waiting = [one for one in robot.sent if one.mode is Mode.WAIT_FOR_OBJECT]
    assert len(waiting) > 800
    np.testing.assert_array_equal([one.q_d for one in waiting], np.tile(OPEN, (len(waiting), 1)))
    assert [line.partition(":")[0] for line in lines] == ["homing", "wait for object", "closing", "running", "stopped"]
    first = next(one for one in robot.sent if one.mode is Mode.RUNNING)
    np.testing.assert_allclose(first.q, HOME, atol=1e-9)
    assert robot.released_at == first.time > 1.0


def test_enter_on_the_terminal_confirms_but_not_what_was_typed_before(monkeypatch: pytest.MonkeyPatch) -> None:
    keyboard, terminal = os.openpty()
    monkeypatch.setattr(sys, "stdin", os.fdopen(terminal))
    os.write(keyboard, b"\n")
    robot = FollowingRobot(HOME)
    robot.confirms = False
    robot.in_read[700].append(lambda robot: os.write(keyboard, b"\x04"))  # Ctrl-D
    robot.in_read[800].append(lambda robot: os.write(keyboard, b"x\x04"))  # half a line
    robot.in_read[1000].append(lambda robot: os.write(keyboard, b"\n"))
    lines: list[str] = []
    run(robot, opened=OPEN, say=lines.append)
    assert "wait for object: put it between the open fingers, then press Enter" in lines
    assert robot.released_at > 1.0
    os.close(keyboard)


@pytest.mark.parametrize("opened", [None, OPEN])
def test_homing_that_gets_nowhere_stops(opened: np.ndarray | None) -> None:
    robot = FollowingRobot(HOME - 0.2, follow=0.0)
    reason = run(robot, opened=opened).reason
    assert reason.startswith("homing: still 0.20 rad" if opened is None else "homing: still 0.10 rad from the goal")
    assert robot.released_at == 0.0


def test_nothing_is_sent_before_measurements_agree_and_without_any_it_ends() -> None:
    robot = FollowingRobot(HOME, {tick: [lambda robot: setattr(robot, "reading", None)] for tick in range(6000)})
    assert run(robot).reason == "no measurement within 5 s"
    assert not robot.sent
    stopped = ControlLoop(Counting(HOME[None]), 0.2, LIMITS, RULES, QUICK, 1.0)
    stopped.stop("before the first measurement")
    stopped.confirm_object()
    assert all(stopped.tick(1e-3 * tick, Reading(1e-3 * tick, HOME)) is None for tick in range(20))
    robot = FollowingRobot(HOME)
    run(robot)
    assert robot.sent[0].time == pytest.approx(6e-3)  # the clock began one tick before the first of five readings


def test_everything_is_compiled_before_the_first_tick() -> None:
    program = """
import numpy as np
from numba.core import event
from tactile_cube.deployment.run_loop import run_loop
from tests.deployment import test_control_loop as loops
compiled = []
class Listener(event.Listener):
    def on_start(self, event): compiled.append(event.data)
    def on_end(self, event): pass
robot = loops.FollowingRobot(loops.HOME)
robot.in_wait[1].append(lambda robot: event.register("numba:compile", Listener()))
print(loops.run(robot).reason, len(robot.sent) > 300, compiled)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert run.stdout.strip() == "time is over True []"


# --- stops -----------------------------------------------------------------------------------------------------------


def for_good(spoil: Spoil, since: int = RUNNING) -> dict[int, list[Spoil]]:
    return {tick: [spoil] for tick in range(since, 20_000)}


def once(spoil: Spoil, at: int = RUNNING) -> dict[int, list[Spoil]]:
    return {at: [spoil]}


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda robot: setattr(robot, "reading", None), "no measurement for 2"),
        (change(q_m=np.full(12, np.nan)), "ring_q1 at nan rad, range -0.52 to 0.52 rad"),
        (change(q_m=lambda q: q + 100.0 * AT), "middle_q2 at 100.4 rad, range -0.35 to 1.50 rad"),
        (change(q_m=lambda q: q + 0.5 * AT), "middle_q2 moved by 0.5"),
        (change(q_m=lambda q: q[:11]), "angles of shape (11,) for 12 joints"),
        (change(time=lambda time: time + 3600.0), "time stamp 3600.2"),
        (change(time=np.nan), "time stamp nan s, the clock says 0.2"),
        (change(time=0.1), "time stamp 0.100 s, the clock says 0.2"),
    ],
)
def test_measurements_that_cannot_be_are_not_believed_and_stop_the_hand_at_its_last_accepted_angles(
    spoil: Spoil, reason: str
) -> None:
    robot = FollowingRobot(HOME, for_good(spoil))
    ended = run(robot, seconds=5.0)
    assert ended.reason.startswith("no measurement for 20 ms, allowed 20 ms")
    assert reason in ended.reason
    before = next(one for one in robot.sent if one.time >= 1e-3 * RUNNING)
    np.testing.assert_array_equal(robot.sent[-1].q_d, before.accepted.q_m)
    assert robot.sent[-1].accepted is before.accepted


@pytest.mark.parametrize("at", [FIRST, FIRST + 2, RUNNING])
@pytest.mark.parametrize(
    "spoil",
    [
        change(q_m=lambda q: q + 100.0 * AT),
        change(q_m=lambda q: q + 1.2 * AT),
        change(q_m=np.full(12, np.nan)),
        change(time=np.inf),
    ],
)
def test_one_bad_measurement_moves_nothing_and_is_counted(spoil: Spoil, at: int) -> None:
    robot, sound = FollowingRobot(HOME, once(spoil, at)), FollowingRobot(HOME)
    assert run(robot).reason.startswith("time is over; 1 measurement(s) not believed, the last: ")
    run(sound)
    assert max(np.abs(one.q_d - one.q).max() for one in robot.sent) <= max(
        np.abs(one.q_d - one.q).max() for one in sound.sent
    )
    late = {RUNNING: 0.0, FIRST + 2: 3e-3}  # until five measurements agree
    assert at == FIRST or robot.sent[-1].time - sound.sent[-1].time == pytest.approx(late[at])


def test_measurements_that_are_lost_now_and_then_stop_nothing_and_leave_gaps_in_the_log(tmp_path: Path) -> None:
    gaps = {tick: [lambda robot: setattr(robot, "reading", None)] for tick in range(20_000) if tick % 10 >= 5}
    robot = FollowingRobot(HOME, gaps)
    with LoopLog(tmp_path / "log.npy", 12) as log:
        assert run(robot, log=log).reason == "time is over"
    assert 240 <= len(log.rows) <= 260
    assert np.diff(log.rows["time"]).max() == pytest.approx(6e-3)


@pytest.mark.parametrize(
    ("start", "reason"),
    [
        (HOME + (DLR_HAND2.upper - HOME + 0.5) * AT, "middle_q2 at 2.001 rad, range -0.35 to 1.50 rad"),
        (np.degrees(HOME), "ring_q1 at 14.4 rad, range -0.52 to 0.52 rad"),
        (np.full(12, np.nan), "ring_q1 at nan rad"),
    ],
)
def test_where_the_hand_cannot_be_it_is_not_commanded(start: np.ndarray, reason: str) -> None:
    robot = FollowingRobot(start)
    ended = run(robot)
    assert ended.reason.startswith("no measurement within 5 s")
    assert reason in ended.reason
    assert robot.sent == []


def test_a_hand_a_little_outside_its_range_is_brought_back_at_the_limited_rate() -> None:
    robot = FollowingRobot(HOME + (DLR_HAND2.upper - HOME + 0.09) * AT, follow=0.05)
    assert run(robot).reason == "time is over"


@pytest.mark.parametrize("answer", [np.full(12, np.nan), HOME + np.inf, HOME[:11], np.array(0.3)])
def test_a_policy_that_gives_no_numbers_stops_the_hand(answer: np.ndarray) -> None:
    robot = FollowingRobot(HOME)
    assert run(robot, answer[None]).reason.startswith("desired angles that are no numbers of 12 joints")
    np.testing.assert_allclose(robot.sent[-1].q_d, HOME, atol=1e-9)


def test_an_answer_far_outside_the_range_is_forgotten_as_fast_as_any_other() -> None:
    robot = FollowingRobot(HOME)
    assert run(robot, np.array([HOME + 1e300, HOME]), seconds=1.5).reason == "time is over"
    np.testing.assert_allclose(robot.sent[-1].q_d, HOME, atol=0.01)


@pytest.mark.parametrize(
    "change",
    [lambda now: now - 3600.0, lambda now: np.nan, lambda now: np.inf, lambda now: now - 1e-3],
    ids=["an hour back", "nan", "inf", "stands still"],
)
def test_a_clock_that_does_not_go_forward_stops_the_hand(change: Callable[[float], float]) -> None:
    robot = FollowingRobot(HOME)
    robot.in_wait[RUNNING].append(clock(change))
    assert run(robot, seconds=5.0).reason.startswith("the clock went from 0.199 s to ")


def test_a_late_tick_stops_and_the_rate_of_the_hold_is_that_of_the_longest_allowed() -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    robot.in_wait[RUNNING].append(clock(lambda now: now + 3600.0))
    assert run(robot, seconds=5.0).reason == "tick 3600001 ms after the one before, allowed 20 ms"
    assert np.abs(np.diff([one.q_d for one in robot.sent], axis=0)).max() <= 6.28 * 0.02


def test_a_finger_that_is_blocked_gets_no_more_than_the_torque_limit_and_stops_after_a_second() -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    assert run(robot, HOME + 0.5 * AT[None], seconds=5.0).reason == "middle_q2: all its torque for 1 s"
    assert max(np.abs(one.q_d - HOME).max() for one in robot.sent) == pytest.approx(1.0 / 3.69)
    np.testing.assert_array_equal(robot.sent[-1].q_d, HOME)  # the hold asks for nothing


def test_only_torque_that_lasts_without_a_break_stops() -> None:
    watchdog, saturated = Watchdog(StopRules(saturation=1.0), DLR_HAND2.joint_names), np.ones(12, dtype=bool)
    assert not any(watchdog.judge(1e-3, 0.0, saturated & (tick % 800 != 0)) for tick in range(2500))


def test_a_finger_that_is_pushed_faster_than_its_command_may_follow_is_not_believed() -> None:
    """The command is at the torque limit, so no other one keeps rate and torque."""
    slow = JointLimits(LIMITS.lower, LIMITS.upper, 1.0, 0.2, LIMITS.kp, LIMITS.kd)
    push = change(q_m=lambda q: q - 0.01 * AT)
    robot = FollowingRobot(HOME, {tick: [push] for tick in range(400, 5000)}, follow=0.0)
    reason = run(robot, HOME[None] + 0.4, seconds=5.0, limits=slow).reason
    assert "middle_q2 at 0.2815 rad, where no command keeps all limits" in reason


@pytest.mark.parametrize(
    ("wanted", "sent"),
    [(np.nan, HOME), (np.inf, HOME), (-np.inf, HOME), (1e308, HOME + 6.28e-3), (-1e308, HOME - 6.28e-3)],
)
def test_whatever_is_wanted_of_the_guard_a_command_that_keeps_all_limits_comes_out(wanted, sent) -> None:
    guard = CommandGuard(LIMITS, RULES, DLR_HAND2.joint_names)
    assert guard.accept(0.0, Reading(0.0, HOME)) == ""
    np.testing.assert_array_equal(first := guard.checked(np.nan, HOME + 1.0), HOME)
    guard.sent(0.0, first)
    np.testing.assert_allclose(guard.checked(1e-3, np.full(12, wanted)), sent, atol=1e-12)


def test_a_time_stamp_that_is_ahead_counts_as_now_so_the_next_reading_is_not_older() -> None:
    guard = CommandGuard(LIMITS, RULES, DLR_HAND2.joint_names)
    assert guard.accept(0.0, Reading(0.015, HOME)) == ""
    assert guard.accept(1e-3, Reading(1e-3, HOME + 0.01)) == ""


@pytest.mark.parametrize("field", ["q_m", "torque"])
@pytest.mark.parametrize("size", [(3,), (12, 1), ()])
def test_a_robot_whose_arrays_have_another_shape_is_not_commanded(field: str, size: tuple[int, ...]) -> None:
    robot = FollowingRobot(HOME, for_good(change(**{field: np.zeros(size)}), FIRST))
    assert f"of shape {size} for 12 joints" in run(robot).reason
    assert robot.sent == []


def test_the_log_can_be_read_while_it_grows_and_says_what_the_disk_refuses(tmp_path: Path) -> None:
    with LoopLog(tmp_path / "log.npy", 2) as log:
        for row in range(3 * CHUNK):
            log.append(Reading(50.0 + row, np.full(2, row)), np.full(2, -row))
        wait_until(lambda: len(np.load(tmp_path / "log.npy")) == 3 * CHUNK)
        log.append(Reading(49.0, np.zeros(2), np.ones(2)), np.zeros(2))
    np.testing.assert_array_equal(log.rows["time"], [*range(3 * CHUNK), -1.0])
    np.testing.assert_array_equal(log.rows["command"][:-1, 1], -log.rows["position"][:-1, 0])
    assert np.isnan(log.rows["torque"][:-1]).all()
    with pytest.raises(OSError, match="No space left"), LoopLog(Path("/dev/full"), 2) as log:
        pass


def test_the_memory_that_a_recording_of_a_run_takes_does_not_grow_with_the_run(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(writing, "BLOCK", 1000)
    signals = [(name, "<f8", (12,)) for name in ("position", "command", "torque")]
    peaks = []
    for rows in (2000, 2000, 40_000):  # the first imports what writes
        log = npy.open_memmap(tmp_path / "log.npy", "w+", np.dtype([("time", "<f8"), *signals]), (rows,))
        log["time"] = np.arange(rows) / 1000.0
        log["position"] = HOME + np.random.default_rng(0).normal(0.0, 0.01, (rows, 12))
        tracemalloc.start()
        write_runs([log], tmp_path / "recording", LIMITS, 1000.0, 0.0)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.5 * peaks[1] < log.nbytes / 4
    trial = read_recording(tmp_path / "recording").trials[0]
    np.testing.assert_array_equal(trial.position, log["position"].astype(np.float32))
    np.testing.assert_array_equal(trial.time, log["time"])


def test_tick_times_are_those_of_all_ticks() -> None:
    times = np.random.default_rng(0).lognormal(-8.0, 1.0, 20_000)
    run = LoopRun(ticks=Counter(np.round(1e6 * times).astype(int).tolist()))
    wanted = [np.quantile(times, share) for share in (0.5, 0.999, 1.0)]
    np.testing.assert_allclose([*run.tick_times.values()], wanted, rtol=0.02)


def wait_until(true: Callable[[], bool]) -> None:
    while not true():
        pass


# --- every way out ---------------------------------------------------------------------------------------------------


class Raising(PlayedTargets):
    """Raises when it is asked for the second time after the rehearsal."""

    def step(self, q_m: np.ndarray, q_f: np.ndarray) -> np.ndarray:
        if self._row:
            raise ZeroDivisionError("in the policy")
        return super().step(q_m, q_f)


@pytest.mark.parametrize("error", [ZeroDivisionError("x"), KeyboardInterrupt(), SystemExit(1)], ids=type)
@pytest.mark.parametrize("where", ["in_wait", "in_read", "in_send"])
def test_an_exception_of_the_robot_sends_the_hold_and_closes(where: str, error: BaseException) -> None:
    robot = FollowingRobot(HOME, follow=0.0)
    getattr(robot, where)[RUNNING].append(raising(error))
    with pytest.raises(type(error)):
        run(robot)
    assert robot.loop.reason.startswith(f"{type(error).__name__}: ")
    np.testing.assert_array_equal(robot.sent[-1].q_d, robot.sent[-1].accepted.q_m)


def test_an_exception_of_the_policy_sends_the_hold_and_closes() -> None:
    robot = FollowingRobot(HOME)
    robot.loop = ControlLoop(Raising(HOME[None] + 0.2), 0.2, LIMITS, RULES, QUICK, 1.0, clock=robot.clock)
    with pytest.raises(ZeroDivisionError, match="in the policy"):
        drive(robot, LIMITS, RULES)
    assert robot.sent[-1].time > 0.1


# --- settings --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan, np.inf])
def test_bounds_without_a_meaning_are_refused(value: float) -> None:
    def limits(**changed: object) -> JointLimits:
        return JointLimits(**(vars(LIMITS) | changed))  # type: ignore[arg-type]

    makers: dict[str, Callable[[], object]] = {
        "rate_limit": lambda: limits(rate=value),
        "torque_limit": lambda: limits(torque=value),
        "seconds": lambda: ControlLoop(PlayedTargets(HOME[None]), 0.2, LIMITS, RULES, QUICK, value),
        "stop.silence": lambda: StopRules(silence=value),
        "homing.speed": lambda: Homing(speed=value),
    }
    for key, maker in makers.items():
        with pytest.raises(InputError, match=rf"{key} is {value}; give a finite number above 0"):
            maker()
    if value != 0:
        with pytest.raises(InputError, match="kp is"):
            limits(kp=np.full(12, value))
        with pytest.raises(InputError, match=f"filter_time is {value}"):
            ControlLoop(PlayedTargets(HOME[None]), value, LIMITS, RULES, QUICK, 1.0)
    with pytest.raises(InputError, match="joint range"):
        limits(lower=LIMITS.upper, upper=LIMITS.lower + (0.0 if np.isfinite(value) else np.nan))


def test_a_reading_or_a_command_that_is_changed_afterwards_changes_nothing() -> None:
    robot = FollowingRobot(HOME)
    buffer = Reading(0.0, HOME.copy())

    def reuse(robot: FollowingRobot) -> None:
        buffer.q_m[:] = robot.q
        robot.reading = Reading(robot.now, buffer.q_m)

    robot.in_read = {tick: [reuse] for tick in range(RUNNING)} | {RUNNING: [raising(OSError())]}  # type: ignore[assignment]
    robot.in_wait[RUNNING].append(lambda robot: buffer.q_m.fill(9.0))
    with pytest.raises(OSError):  # noqa: PT011
        run(robot)
    assert np.abs(robot.sent[-1].q_d - HOME).max() < 0.2
