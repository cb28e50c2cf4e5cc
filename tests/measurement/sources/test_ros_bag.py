from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.ros_bag import RosBag, unpacked
from tactile_cube.measurement.sources.source import source_settings
from tests.measurement.small_rig import URDF, table
from tests.measurement.sources.small_bag import write_bag

pytest.importorskip("mcap_ros2.writer", reason="needs the extra `ros`")
import lz4.frame
import zstandard


@pytest.fixture(params=["ZSTD", "LZ4", "NONE"])
def bag(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """States of both joints in another order than the rig's, commands as bare arrays."""
    (tmp_path / "rig.urdf").write_text(URDF)
    write_bag(tmp_path / "bag.mcap", request.param)
    return tmp_path / "bag.mcap"


def source(bag: Path, **changes: object) -> RosBag:
    settings = {
        "files": [str(bag)],
        "urdf": str(bag.parent / "rig.urdf"),
        "joints": ["a", "b"],
        "controller": {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0},
    }
    return RosBag(**{k: v for k, v in source_settings("mcap", settings | changes).items() if k != "_target_"})


def test_a_bag_becomes_a_recording_by_joint_names(bag: Path, tmp_path: Path) -> None:
    write_recording(tmp_path / "r", source(bag).recordings(0)[""])
    recording = read_recording(tmp_path / "r")
    trial = recording.trials[0]
    assert recording.rate == pytest.approx(100.0)
    assert recording.description.sensors.read == "before"
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


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_chunk_is_unpacked_no_further_than_it_says(compression: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from mcap.records import Chunk

    content = bytes(10_000)  # 1 GB of zeros would be as small
    packed = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}[compression](content)
    chunk = Chunk(compression, packed, 0, 0, 0, len(content))
    assert unpacked(chunk).data == content
    with pytest.raises(ValueError, match="a chunk is not of the 100 bytes that it says"):
        unpacked(replace(chunk, uncompressed_size=100))
    monkeypatch.setattr(limits, "CHUNK", 9_999)
    with pytest.raises(ValueError, match=r"a chunk of 0\.01 MB"):
        unpacked(chunk)


def test_a_bag_of_more_messages_than_memory_holds_is_refused(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MESSAGES", 599)
    with pytest.raises(InputError, match="more than 599 messages on /joint_states and /joint_commands; split the bag"):
        source(bag).recordings(0)


def test_a_truncated_bag_is_an_error(bag: Path) -> None:
    bag.write_bytes(bag.read_bytes()[:2000])
    with pytest.raises(InputError, match=r"bag\.mcap"):
        source(bag).recordings(0)
