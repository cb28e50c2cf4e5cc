"""A hand behind ROS 2: joint states come in as sensor_msgs/JointState, desired angles go out as the same."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from tactile_cube.deployment.robot import Array, Reading, require_positive
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand


class Ros2Hand:
    """A node that subscribes to joint states and publishes desired angles; arguments are those of conf/robot/ros2.yaml.

    Raises:
        InputError: ROS 2 is not there, a joint that the hand has not, or no angle or direction.
    """

    def __init__(
        self,
        states: str = "/joint_states",
        commands: str = "/joint_commands",
        confirm: str = "/object_in_place",
        names: Mapping[str, str] | None = None,
        zeros: Mapping[str, float] | None = None,
        directions: Mapping[str, int] | None = None,
        rate: float = 1000.0,
        hand: Hand = DLR_HAND2,
    ) -> None:
        try:
            import rclpy
            from rclpy.signals import SignalHandlerOptions
            from sensor_msgs.msg import JointState
            from std_msgs.msg import Empty
        except ImportError as error:
            raise InputError(f"robot=ros2: {error}; source ROS 2's setup.bash, whose Python must be this one") from None
        joints = hand.joint_names
        require_positive({"robot.rate": rate})
        for key, mapping in {"names": names, "zeros": zeros, "directions": directions}.items():
            for name in mapping or {}:
                if name not in joints:
                    raise InputError(f"robot.{key}: no joint {name!r}; the hand has {', '.join(joints)}")
        self._names = [(names or {}).get(joint, joint) for joint in joints]
        self._zeros = np.array([(zeros or {}).get(joint, 0.0) for joint in joints], dtype=np.float64)
        self._directions = np.array([float((directions or {}).get(joint, 1)) for joint in joints])
        self._refuse_what_scales()
        self._period, self._next = 1.0 / rate, time.monotonic()
        self._new: Reading | None = None
        self._waits = self._confirmed = False
        self._rclpy, self._message = rclpy, JointState
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # its own would end the context before the hold
        self._node = rclpy.create_node("tactile_cube")
        self._node.create_subscription(JointState, states, self._hear, 1)
        self._node.create_subscription(Empty, confirm, self._confirm, 1)
        self._publisher = self._node.create_publisher(JointState, commands, 1)
        self._confirm_topic = confirm

    def wait(self) -> float:
        """Sleep until the next tick; a tick that is late already is not waited for."""
        self._next = max(self._next + self._period, time.monotonic() - self._period)
        time.sleep(max(0.0, self._next - time.monotonic()))
        return time.monotonic()

    def read(self) -> Reading | None:
        """Process the messages received and return the newest measurement, or None."""
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

    def wait_for_object(self) -> bool:
        """Log once how to confirm; return whether somebody has confirmed since."""
        if not self._waits:
            self._waits = True
            self._node.get_logger().info(f"wait for object: confirm with std_msgs/Empty on {self._confirm_topic}")
        return self._confirmed

    def release(self) -> None:
        """Log that the policy decides from now on."""
        self._node.get_logger().info("release the object: the policy decides")

    def close(self) -> None:
        """Shut the node down."""
        self._node.destroy_node()
        self._rclpy.try_shutdown()

    def _hear(self, message: Any) -> None:
        """Keep a joint state that has every joint of the hand; others on the topic are not meant for it."""
        places = {name: place for place, name in enumerate(message.name)}
        if any(name not in places for name in self._names) or len(message.position) != len(message.name):
            return
        stamp, order = message.header.stamp, [places[name] for name in self._names]
        age = 1e-9 * (self._node.get_clock().now().nanoseconds - 1_000_000_000 * stamp.sec - stamp.nanosec)
        q_m = self._directions * (np.array(message.position, dtype=np.float64)[order] - self._zeros)
        felt = len(message.effort) == len(message.name)
        torque = self._directions * np.array(message.effort, dtype=np.float64)[order] if felt else None
        self._new = Reading(time.monotonic() - age, q_m, torque)

    def _confirm(self, message: Any) -> None:
        """Take a confirmation, but only while it is waited for."""
        self._confirmed = self._waits

    def _refuse_what_scales(self) -> None:
        """Refuse what would change a command by more than a sign and a known angle."""
        if not np.isfinite(self._zeros).all():
            raise InputError(f"robot.zeros: {self._zeros}; give angles in rad")
        if not np.isin(self._directions, (1.0, -1.0)).all():
            raise InputError(f"robot.directions: {self._directions}; give 1 or -1")
        if len(set(self._names)) < len(self._names):
            raise InputError(f"robot.names: two joints with one name in {', '.join(self._names)}")
