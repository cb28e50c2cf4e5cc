"""A stand-in of rclpy: what it delivers, what it refuses, and how its signal handlers close the context."""

import signal
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


class Stamp(SimpleNamespace):
    """builtin_interfaces/Time of a time in nanoseconds."""

    def __init__(self, nanoseconds: int = 0) -> None:
        super().__init__(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


class JointState:
    """sensor_msgs/JointState, as far as it is used."""

    def __init__(self, **fields: Any) -> None:
        self.header = SimpleNamespace(stamp=Stamp())
        self.name, self.position, self.velocity, self.effort = [], [], [], []
        self.__dict__.update(fields)


class Empty:
    """std_msgs/Empty."""


class Node:
    """One node of a process; spun once, it gives one message that is queued to its subscription."""

    def __init__(self) -> None:
        self.queue: list[Any] = []
        self.published: list[JointState] = []
        self.said: list[str] = []
        self.callbacks: dict[type, Any] = {}
        self.topics: dict[type, str] = {}
        self.open = self.destroyed = False
        self.elapsed = 0  # [ns] on every clock of this computer

    def create_subscription(self, kind: type, topic: str, callback: Any, depth: int) -> None:
        self.callbacks[kind], self.topics[kind] = callback, topic

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        assert kind is JointState
        return SimpleNamespace(publish=self.publish)

    def publish(self, message: JointState) -> None:
        if not self.open:
            raise RuntimeError("publisher's context is invalid")
        self.published.append(message)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=self.ros_time, to_msg=lambda: "now"))

    @property
    def ros_time(self) -> int:
        return 1_700_000_000 * 10**9 + self.elapsed

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self.said.append)

    def destroy_node(self) -> None:
        self.destroyed = True


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Node:
    """The node that whatever imports rclpy gets; the clocks of `ros2_hand` are its."""
    node = Node()

    def close(*_: Any) -> None:
        node.open = False

    def init(signal_handler_options: str = "ALL") -> None:
        node.open = True
        if signal_handler_options != "NO":
            signal.signal(signal.SIGINT, close)

    def spin_once(spun: Node, timeout_sec: float) -> None:
        if not node.open:
            raise RuntimeError("ExternalShutdownException")
        if spun.queue:
            message = spun.queue.pop(0)
            spun.callbacks[type(message)](message)

    def sleep(seconds: float) -> None:
        node.elapsed += round(1e9 * seconds)

    contents = {
        "rclpy": {"init": init, "try_shutdown": close, "create_node": lambda name: node, "spin_once": spin_once},
        "rclpy.signals": {"SignalHandlerOptions": SimpleNamespace(NO="NO", ALL="ALL")},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"JointState": JointState},
        "std_msgs": {},
        "std_msgs.msg": {"Empty": Empty},
    }
    for name, members in contents.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    clock = SimpleNamespace(monotonic=lambda: 50.0 + 1e-9 * node.elapsed, sleep=sleep)
    monkeypatch.setattr("tactile_cube.deployment.ros2_hand.time", clock)
    return node
