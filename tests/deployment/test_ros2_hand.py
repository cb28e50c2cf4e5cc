"""The ROS 2 side against a stand-in of rclpy: joint states in, desired angles out, in the robot's own joints."""

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.deployment.command_guard import REPEATS
from tactile_cube.deployment.control_loop import ControlLoop, Homing
from tactile_cube.deployment.controller import PlayedTargets
from tactile_cube.deployment.robot import JointLimits, StopRules
from tactile_cube.deployment.ros2_hand import Ros2Hand
from tactile_cube.deployment.run_loop import LoopLog, LoopRun, run_loop
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tests.deployment.fake_rclpy import Empty, JointState, Node, Stamp, node

__all__ = ["node"]
NAMES = list(DLR_HAND2.joint_names)
HOME = np.asarray(DLR_HAND2.start_angles)
OTHER: dict[str, Any] = {"names": {"ring_q1": "abduction"}, "zeros": {"ring_q1": 0.5}, "directions": {"ring_q1": -1}}


def state(node: Node, age: float = 0.0, **fields: Any) -> JointState:
    message = JointState(**({"name": NAMES, "position": HOME} | fields))
    message.header.stamp = Stamp(node.ros_time - round(1e9 * age))
    return message


def test_joint_states_are_sorted_turned_and_shifted_into_the_hands_own_joints(node: Node) -> None:
    hand = Ros2Hand(**OTHER)
    names, values = ["abduction", *NAMES[1:]][::-1], np.arange(12.0)
    node.queue.append(state(node, name=names, position=values, effort=0.01 * values))
    reading = hand.read()
    assert reading is not None
    assert reading.q_m[0] == -(11.0 - 0.5)
    np.testing.assert_allclose(reading.q_m[1:], values[::-1][1:])
    assert reading.torque is not None
    assert reading.torque[0] == pytest.approx(-0.11)
    assert hand.read() is None


def test_commands_go_out_in_the_robots_joints_and_back_they_are_the_same(node: Node) -> None:
    hand = Ros2Hand(**OTHER)
    q_d = np.linspace(-0.2, 0.4, 12)
    hand.send(q_d)
    (message,) = node.published
    assert message.name[0] == "abduction"
    assert message.position[0] == pytest.approx(0.5 - q_d[0])
    node.queue.append(state(node, name=message.name, position=message.position))
    reading = hand.read()
    assert reading is not None
    np.testing.assert_allclose(reading.q_m, q_d)


@pytest.mark.parametrize("fields", [{"name": ["arm_1"], "position": [1.0]}, {"position": HOME[:11]}, {"position": []}])
def test_states_that_lack_a_joint_are_not_meant_for_the_hand(node: Node, fields: dict[str, Any]) -> None:
    hand = Ros2Hand()
    node.queue.append(state(node, **fields))
    assert hand.read() is None


@pytest.mark.parametrize("fields", [{"velocity": [0.1]}, {"effort": [0.1]}, {"velocity": [np.nan] * 12}])
def test_short_velocities_and_efforts_are_left_out(node: Node, fields: dict[str, Any]) -> None:
    hand = Ros2Hand()
    node.queue.append(state(node, **fields))
    reading = hand.read()
    assert reading is not None
    assert reading.torque is None
    np.testing.assert_array_equal(reading.q_m, HOME)


@pytest.mark.parametrize("age", [0.0, 0.015, 3600.0, -3600.0])
def test_a_reading_is_as_old_as_its_stamp_says_not_as_its_arrival(node: Node, age: float) -> None:
    hand = Ros2Hand()
    node.queue.append(state(node, age))
    reading = hand.read()
    assert reading is not None
    assert reading.time == pytest.approx(50.0 - age, abs=1e-6)


def test_ticks_come_at_their_rate_and_a_late_one_is_not_waited_for(node: Node) -> None:
    hand = Ros2Hand(rate=200.0)
    assert np.diff([hand.wait() for _ in range(5)]) == pytest.approx(0.005)
    node.elapsed += 10**9
    assert hand.wait() == pytest.approx(51.025, abs=1e-3)
    assert hand.wait() == pytest.approx(51.025, abs=6e-3)


class Loopback:
    """A hand behind the topics whose joints follow at once; `spoil` changes each state before it is published."""

    def __init__(self, node: Node, spoil: Callable[[int, JointState], None] = lambda tick, message: None) -> None:
        self.hand, self.node, self.spoil, self.ticks = Ros2Hand(), node, spoil, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.hand, name)

    def read(self) -> Any:
        self.ticks += 1
        q = self.node.published[-1].position if self.node.published else HOME
        message = state(self.node, position=q)
        self.spoil(self.ticks, message)
        self.node.queue.append(message)
        return self.hand.read()


def run(robot: Loopback, opened: bool = False, log: LoopLog | None = None) -> LoopRun:
    limits = JointLimits(DLR_HAND2.lower, DLR_HAND2.upper, 6.28, 1.0, np.full(12, 3.69), np.full(12, 0.25))
    homing, waits = Homing(speed=1.0, settle=0.05), HOME - 0.1 if opened else None
    loop = ControlLoop(PlayedTargets(HOME[None] + 0.1), 0.2, limits, StopRules(), homing, 0.5, opened=waits)
    return run_loop(loop, robot, lambda line: None, log)


def test_the_loop_runs_to_its_end_on_the_node(node: Node, tmp_path: Path) -> None:
    with LoopLog(tmp_path / "log.npy", 12) as log:
        assert run(Loopback(node), log=log).reason == "time is over"
    assert len(log.rows) == 499
    assert node.destroyed
    assert not node.open


def test_the_object_is_confirmed_on_a_topic_but_not_before_it_is_waited_for(node: Node) -> None:
    def confirm(tick: int, message: JointState) -> None:
        if tick in (20, 1000):
            node.queue.append(Empty())

    robot = Loopback(node, confirm)
    assert run(robot, opened=True).reason == "time is over"
    assert robot.ticks > 1500
    assert node.topics[Empty] == "/object_in_place"
    assert node.said == [
        "wait for object: confirm with std_msgs/Empty on /object_in_place",
        "release the object: the policy decides",
    ]


def test_old_states_that_keep_arriving_stop_the_hand(node: Node) -> None:
    def stuck(tick: int, message: JointState) -> None:
        if tick > 200:
            message.header.stamp = Stamp(1_700_000_000 * 10**9)

    assert "no measurement for 2" in run(Loopback(node, stuck)).reason


def test_ctrl_c_publishes_the_hold_before_the_context_is_closed(node: Node) -> None:
    def interrupt(tick: int, message: JointState) -> None:
        if tick == 200:
            os.kill(os.getpid(), signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    robot = Loopback(node, interrupt)
    assert signal.getsignal(signal.SIGINT) is handler  # rclpy's own would close the context
    assert run(robot).reason == "interrupted by SIGINT"
    assert len(node.published) >= 195 + REPEATS
    assert not node.open


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"zeros": {"ring": 0.1}}, r"robot\.zeros: no joint 'ring'"),
        ({"zeros": {"ring_q1": np.nan}}, r"robot\.zeros: .*nan.*; give angles in rad"),
        ({"directions": {"ring_q1": 57.3}}, r"robot\.directions: .*57\.3.*; give 1 or -1"),
        ({"names": {"ring_q1": "ring_q2"}}, r"robot\.names: two joints with one name"),
        ({"rate": np.nan}, r"robot\.rate is nan"),
    ],
)
def test_what_would_change_a_command_is_refused(node: Node, setting: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Ros2Hand(**setting)


def test_without_ros_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(InputError, match=r"robot=ros2: .*setup\.bash"):
        Ros2Hand()
