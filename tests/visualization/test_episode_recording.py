import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.object_mesh import read_mesh
from tactile_cube.visualization.episode_recording import write_episode
from tests.evaluation.synthetic import episode
from tests.meshes import CUBE, write_obj


def moving() -> EpisodeRecord:
    """An episode whose joints read something else at every physics step."""
    record, rng = episode(steps=20), np.random.default_rng(0)
    signals = {name: rng.normal(size=(1000, 12)) for name in ("q_m", "q_f")}
    policy = {name: rng.uniform(-1.0, 1.0, size=(20, 12)) for name in ("q_m", "e_q", "action")}
    return replace(record, trace=record.trace | signals, policy=policy)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rerun") / "episode.rrd"
    write_episode(moving(), path, summary="# holding")
    return path


def rows(path: Path, entity: str, column: str) -> np.ndarray:
    """All values of a column of an entity as an array."""
    return np.array(listed(path, entity, column))


def listed(path: Path, entity: str, column: str) -> list[Any]:
    """All values of a column of an entity, in the order of the file."""
    return [
        value
        for chunk in RrdReader(path).stream()
        if chunk.entity_path == entity and column in chunk.to_record_batch().schema.names
        for value in chunk.to_record_batch().column(column).to_pylist()
    ]


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


def test_every_joint_moves_the_coupled_ones_too(recording: Path) -> None:
    for finger in DLR_HAND2.fingers:
        for joint in range(1, 5):
            entity = f"/hand/joint_transforms/{finger.name}_q{joint}"
            assert len(rows(recording, entity, "Transform3D:quaternion")) == 100


def test_contacts_are_arrows(recording: Path) -> None:
    vectors = rows(recording, "/contacts", "Arrows3D:vectors")
    assert vectors.shape == (21, 4, 3)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), 0.03, rtol=1e-5)


def test_what_the_policy_gets_and_asks_comes_back_at_10_hz(recording: Path) -> None:
    policy = moving().policy
    middle = 0.5 * (DLR_HAND2.action_lower + DLR_HAND2.action_upper)
    half = DLR_HAND2.action_upper - middle
    expected = {"q_m": policy["q_m"], "e_q": policy["e_q"], "action": middle + half * policy["action"]}
    for place, finger in enumerate(("ring", "middle", "fore", "thumb")):
        for name, values in expected.items():
            found = rows(recording, f"/policy/{finger}/{name}", "Scalars:scalars")
            np.testing.assert_allclose(found, values[:, 3 * place : 3 * place + 3])
    for signal, length in (("q_f", 1000), ("q_n", 20)):
        assert rows(recording, f"/joints/ring/{signal}", "Scalars:scalars").shape == (length, 3)


def test_the_trail_follows_a_corner_of_the_cube(recording: Path) -> None:
    strips = listed(recording, "/trail", "LineStrips3D:strips")
    record = episode(steps=20)
    assert len(strips) == 21
    corner = record.cube_position[-1] + Rotation.from_quat(record.cube_quaternion[-1]).apply(record.cube_size / 2)
    np.testing.assert_allclose(strips[-1][0][-1], corner, atol=1e-6)


def test_an_episode_without_a_trace_can_be_recorded(tmp_path: Path) -> None:
    write_episode(episode(steps=5, trace={}), tmp_path / "short.rrd")
    assert len(rows(tmp_path / "short.rrd", "/cube", "Transform3D:translation")) == 6


def test_a_mesh_is_shown_as_its_faces(tmp_path: Path) -> None:
    mesh, size = read_mesh(write_obj(tmp_path, 0.08 * CUBE))
    record = replace(episode(steps=3), object_shape=mesh, cube_size=size, trace={})
    write_episode(record, tmp_path / "mesh.rrd", summary="")
    sides = [listed(tmp_path / "mesh.rrd", f"/cube/part{side}", "Mesh3D:vertex_positions")[0] for side in range(6)]
    corners = np.vstack(sides)
    assert len(corners) == 3 * 12
    np.testing.assert_allclose(np.abs(corners), 0.04, atol=1e-6)
