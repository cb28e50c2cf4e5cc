"""The ROS 2 side against a stand-in of rclpy: joint states in, desired angles out, in the robot's own joints."""

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.deployment.ros2_hand import Ros2Hand
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2


class JointState:
    """sensor_msgs/JointState, as far as it is used."""

    def __init__(self, **fields: Any) -> None:
        self.header = SimpleNamespace(stamp=None)
        self.name, self.position, self.velocity, self.effort = [], [], [], []
        self.__dict__.update(fields)


class Node:
    """Delivers what is queued when it is spun, and keeps what is published."""

    def __init__(self) -> None:
        self.queue: list[JointState] = []
        self.published: list[JointState] = []
        self.said: list[str] = []
        self.closed = False

    def create_subscription(self, kind: type, topic: str, callback: Any, depth: int) -> None:
        assert kind is JointState
        self.states, self.callback = topic, callback

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        self.commands = topic
        return SimpleNamespace(publish=self.published.append)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now"))

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self.said.append)

    def destroy_node(self) -> None:
        self.closed = True


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Node:
    node = Node()

    def spin_once(spun: Node, timeout_sec: float) -> None:
        while spun.queue:
            spun.callback(spun.queue.pop(0))

    rclpy, messages, package = ModuleType("rclpy"), ModuleType("sensor_msgs.msg"), ModuleType("sensor_msgs")
    vars(rclpy).update(init=lambda: None, shutdown=lambda: None, create_node=lambda name: node, spin_once=spin_once)
    vars(messages).update(JointState=JointState)
    for name, module in (("rclpy", rclpy), ("sensor_msgs", package), ("sensor_msgs.msg", messages)):
        monkeypatch.setitem(sys.modules, name, module)
    return node


def test_joint_states_are_sorted_turned_and_shifted_into_the_hands_own_joints(node: Node) -> None:
    hand = Ros2Hand(names={"ring_q1": "abduction"}, zeros={"ring_q1": 0.5}, directions={"ring_q1": -1})
    names = ["abduction", *DLR_HAND2.joint_names[1:]][::-1]
    values = np.arange(12.0)
    node.queue.append(JointState(name=names, position=values, velocity=0.1 * values, effort=0.01 * values))
    reading = hand.read()
    assert reading is not None
    assert reading.q_m[0] == -(11.0 - 0.5)
    np.testing.assert_allclose(reading.q_m[1:], values[::-1][1:])
    assert reading.dq[0] == pytest.approx(-1.1)
    assert reading.torque is not None
    assert reading.torque[0] == pytest.approx(-0.11)
    assert hand.read() is None


def test_commands_go_out_in_the_robots_joints_and_back_they_are_the_same(node: Node) -> None:
    hand = Ros2Hand(names={"ring_q1": "abduction"}, zeros={"ring_q1": 0.5}, directions={"ring_q1": -1})
    q_d = np.linspace(-0.2, 0.4, 12)
    hand.send(q_d)
    (message,) = node.published
    assert message.name[0] == "abduction"
    assert message.position[0] == pytest.approx(0.5 - q_d[0])
    node.queue.append(JointState(name=message.name, position=message.position))
    reading = hand.read()
    assert reading is not None
    np.testing.assert_allclose(reading.q_m, q_d)
    hand.hand_over()
    hand.close()
    assert "hand over the cube" in node.said[0]
    assert node.closed


def test_states_of_other_joints_are_not_meant_for_the_hand(node: Node) -> None:
    hand = Ros2Hand()
    node.queue.append(JointState(name=["arm_1"], position=[1.0]))
    assert hand.read() is None


def test_the_clock_ticks_at_its_rate(node: Node) -> None:
    hand = Ros2Hand(rate=200.0)
    times = [hand.wait() for _ in range(21)]
    assert 0.09 < times[-1] - times[0] < 2.0


def test_a_joint_that_the_hand_has_not_is_refused(node: Node) -> None:
    with pytest.raises(InputError, match=r"robot\.zeros: no joint 'ring'"):
        Ros2Hand(zeros={"ring": 0.1})


def test_without_ros_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(InputError, match=r"robot=ros2: .*setup\.bash"):
        Ros2Hand()
