import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tactile_cube.hand import DLR_HAND2
from tactile_cube.visualization.episode_recording import write_recording
from tests.evaluation.synthetic import episode


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rerun") / "episode.rrd"
    write_recording(episode(steps=20), path, summary="# holding")
    return path


def rows(path: Path, entity: str, column: str) -> np.ndarray:
    """All values of a column of an entity, in the order of the file."""
    values = [
        value
        for chunk in RrdReader(path).stream()
        if chunk.entity_path == entity and column in chunk.to_record_batch().schema.names
        for value in chunk.to_record_batch().column(column).to_pylist()
    ]
    return np.array(values)


def test_the_file_is_sound(recording: Path) -> None:
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(recording)]
    assert subprocess.run(command, capture_output=True, timeout=60).returncode == 0


def test_joint_signals_come_back_at_500_hz(recording: Path) -> None:
    for finger in ("ring", "middle", "fore", "thumb"):
        for signal in ("q", "q_m", "q_d", "torque"):
            assert rows(recording, f"/joints/{finger}/{signal}", "Scalars:scalars").shape == (1000, 3)
    times = rows(recording, "/joints/ring/q", "time")
    assert len(times) == 1000


def test_theta_and_reward_terms_come_back(recording: Path) -> None:
    theta = rows(recording, "/task/theta", "Scalars:scalars").ravel()
    np.testing.assert_allclose(theta, np.linspace(0.0, 4.0, 21))
    np.testing.assert_allclose(rows(recording, "/task/reward/plane", "Scalars:scalars").ravel(), -0.5)
    np.testing.assert_allclose(rows(recording, "/curriculum/filter_time", "Scalars:scalars").ravel(), 0.5)


def test_every_joint_moves_the_coupled_ones_too(recording: Path) -> None:
    for finger in DLR_HAND2.fingers:
        for joint in range(1, 5):
            entity = f"/hand/joint_transforms/{finger.name}_q{joint}"
            assert len(rows(recording, entity, "Transform3D:quaternion")) == 100


def test_contacts_are_arrows(recording: Path) -> None:
    vectors = rows(recording, "/contacts", "Arrows3D:vectors")
    assert vectors.shape == (21, 4, 3)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), 0.03, rtol=1e-5)


def test_the_blueprint_is_inside(recording: Path) -> None:
    assert len(RrdReader(recording).blueprints()) == 1


def test_an_episode_without_a_trace_can_be_recorded(tmp_path: Path) -> None:
    write_recording(episode(steps=5, trace={}), tmp_path / "short.rrd")
    assert len(rows(tmp_path / "short.rrd", "/cube", "Transform3D:translation")) == 6
