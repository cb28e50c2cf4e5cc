"""A hand behind ROS 2: joint states come in as sensor_msgs/JointState, desired angles go out as the same."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.deployment.robot import Reading
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand

Array = NDArray[np.float64]


class Ros2Hand:
    """A node that subscribes to joint states and publishes desired angles; needs rclpy and sensor_msgs of ROS 2.

    Args:
        states: topic of the joint states; velocities that are missing are taken from the angles.
        commands: topic of the desired angles, for an impedance controller with the contract's gains.
        names: joint of this package -> joint of the robot, where they are called otherwise.
        zeros: angle of the robot's joint where this package's is zero [rad]; by default 0.
        directions: -1 where the robot counts the other way; by default 1.
        rate: of the fast loop [Hz].

    Raises:
        InputError: ROS 2 is not there, or a joint that the hand has not.
    """

    def __init__(
        self,
        states: str = "/joint_states",
        commands: str = "/joint_commands",
        names: Mapping[str, str] | None = None,
        zeros: Mapping[str, float] | None = None,
        directions: Mapping[str, int] | None = None,
        rate: float = 1000.0,
        hand: Hand = DLR_HAND2,
    ) -> None:
        try:
            import rclpy
            from sensor_msgs.msg import JointState
        except ImportError as error:
            raise InputError(f"robot=ros2: {error}; source ROS 2's setup.bash, whose Python must be this one") from None
        joints = hand.joint_names
        _refuse_unknown(joints, names=names, zeros=zeros, directions=directions)
        self._names = [(names or {}).get(joint, joint) for joint in joints]
        self._zeros = np.array([(zeros or {}).get(joint, 0.0) for joint in joints])
        self._directions = np.array([float((directions or {}).get(joint, 1)) for joint in joints])
        self._period, self._next = 1.0 / rate, time.monotonic()
        self._new: Reading | None = None
        self._before: Reading | None = None
        self._rclpy, self._message = rclpy, JointState
        rclpy.init()
        self._node = rclpy.create_node("tactile_cube")
        self._node.create_subscription(JointState, states, self._hear, 1)
        self._publisher = self._node.create_publisher(JointState, commands, 1)

    def wait(self) -> float:
        """Sleep until the next tick; a tick that is late already is not waited for."""
        self._next = max(self._next + self._period, time.monotonic() - self._period)
        time.sleep(max(0.0, self._next - time.monotonic()))
        return time.monotonic()

    def read(self) -> Reading | None:
        """Take what has come in and return the newest, or None."""
        self._rclpy.spin_once(self._node, timeout_sec=0.0)
        reading, self._new = self._new, None
        return reading

    def send(self, q_d: Array) -> None:
        """Publish desired angles in the robot's own joints."""
        message = self._message()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.name = list(self._names)
        message.position = [float(value) for value in self._directions * q_d + self._zeros]
        self._publisher.publish(message)

    def hand_over(self) -> None:
        """Say that the cube may now be given to the hand."""
        self._node.get_logger().info("fingers in place: hand over the cube")

    def close(self) -> None:
        """Leave ROS 2."""
        self._node.destroy_node()
        self._rclpy.shutdown()

    def _hear(self, message: Any) -> None:
        """Keep a joint state that has every joint of the hand; others on the topic are not meant for it."""
        places = {name: place for place, name in enumerate(message.name)}
        if any(name not in places for name in self._names):
            return
        now, order = time.monotonic(), [places[name] for name in self._names]
        q_m = self._directions * (_ordered(message.position, order) - self._zeros)
        dq = self._directions * _ordered(message.velocity, order) if len(message.velocity) else self._slope(now, q_m)
        torque = self._directions * _ordered(message.effort, order) if len(message.effort) else None
        self._new = self._before = Reading(now, q_m, dq, torque)

    def _slope(self, now: float, q_m: Array) -> Array:
        if self._before is None or now <= self._before.time:
            return np.zeros_like(q_m)
        return (q_m - self._before.q_m) / (now - self._before.time)


def _ordered(values: Sequence[float], order: list[int]) -> Array:
    return np.asarray(values, dtype=np.float64)[order]


def _refuse_unknown(joints: Sequence[str], **given: Mapping[str, Any] | None) -> None:
    for key, mapping in given.items():
        for name in mapping or {}:
            if name not in joints:
                raise InputError(f"robot.{key}: no joint {name!r}; the hand has {', '.join(joints)}")
