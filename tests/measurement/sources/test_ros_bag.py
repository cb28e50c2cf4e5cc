from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.ros_bag import RosBag
from tests.measurement.small_rig import URDF, table
from tests.measurement.sources.small_bag import write_bag

pytest.importorskip("mcap_ros2.writer", reason="needs the extra `ros`")


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """States of both joints in another order than the rig's, commands as bare arrays."""
    (tmp_path / "rig.urdf").write_text(URDF)
    write_bag(tmp_path / "bag.mcap")
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
