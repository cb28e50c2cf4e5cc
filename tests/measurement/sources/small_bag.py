"""A bag of two joints, as ROS 2 records it."""

from pathlib import Path

from tests.measurement.small_rig import table

JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
ARRAY = """std_msgs/MultiArrayLayout layout
float64[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
"""


def write_bag(path: Path, compression: str = "ZSTD") -> None:
    """Write states of both joints in another order than the rig's, and commands as bare arrays."""
    from mcap.writer import CompressionType
    from mcap_ros2 import writer

    columns = table()
    with path.open("wb") as stream:
        output = writer.Writer(stream, compression=CompressionType[compression])
        states = output.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        commands = output.register_msgdef("std_msgs/msg/Float64MultiArray", ARRAY)
        for row, time in enumerate(columns["time"]):
            stamp = round(1e9 * (100.0 + time))
            order = [float(columns[f"{joint}.command"][row]) for joint in "ab"]
            output.write_message("/joint_commands", commands, {"layout": {"dim": [], "data_offset": 0}, "data": order},
                                 log_time=stamp, publish_time=stamp)  # fmt: skip
            header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": ""}
            state = {
                "header": header,
                "name": ["b", "wheel", "a"],
                "position": [columns["b.position"][row], 0.0, columns["a.position"][row]],
                "velocity": [],
                "effort": [columns["b.torque"][row], 0.0, columns["a.torque"][row]],
            }
            output.write_message("/joint_states", states, state, log_time=stamp + 10**6, publish_time=stamp + 10**6)
        output.finish()
