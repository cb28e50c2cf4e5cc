from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.ros_bag import RosBag
from tests.measurement.small_rig import URDF, table

writer = pytest.importorskip("mcap_ros2.writer", reason="needs the extra `ros`")

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


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """States of both joints in another order than the rig's, commands as bare arrays."""
    columns = table()
    (tmp_path / "rig.urdf").write_text(URDF)
    with (tmp_path / "bag.mcap").open("wb") as stream:
        output = writer.Writer(stream)
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
    return tmp_path / "bag.mcap"


def source(bag: Path, **changes: object) -> RosBag:
    settings = {
        "files": [str(bag)],
        "urdf": str(bag.parent / "rig.urdf"),
        "joints": ["a", "b"],
        "controller": {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0},
    }
    return RosBag(**(settings | changes))  # type: ignore[arg-type]


def test_a_bag_becomes_a_recording_by_joint_names(bag: Path, tmp_path: Path) -> None:
    write_recording(tmp_path / "r", source(bag).recordings(0)[""])
    recording = read_recording(tmp_path / "r")
    trial = recording.trials[0]
    assert recording.rate == pytest.approx(100.0)
    assert recording.read == "before"
    assert np.allclose(trial.position[:, 0], table()["a.position"], atol=1e-6)
    assert np.allclose(trial.command[:, 1], table()["b.command"], atol=1e-6)
    assert trial.torque is not None
    assert np.allclose(trial.torque[:, 0], table()["a.torque"], atol=1e-6)


def test_a_wrong_topic_is_named(bag: Path) -> None:
    with pytest.raises(InputError, match="0 messages on topic '/orders'"):
        source(bag, commands="/orders").recordings(0)


def test_a_missing_joint_is_named(bag: Path) -> None:
    with pytest.raises(InputError, match="'elbow' is missing"):
        source(bag, joints=["a", "elbow"]).recordings(0)


def test_a_truncated_bag_is_an_error(bag: Path) -> None:
    bag.write_bytes(bag.read_bytes()[:2000])
    with pytest.raises(InputError, match=r"bag\.mcap"):
        source(bag).recordings(0)
