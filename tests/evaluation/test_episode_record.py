from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import ARRAY_FIELDS, CONTACT_FIELDS, EpisodeRecord
from tactile_cube.hand.object_mesh import ObjectMesh, read_mesh
from tests.evaluation.synthetic import episode
from tests.meshes import CUBE, write_obj


def test_a_saved_record_comes_back_unchanged(tmp_path: Path) -> None:
    record = episode(steps=5, policy={"action": np.ones((5, 12))})
    record.save(tmp_path / "episode.npz")
    loaded = EpisodeRecord.load(tmp_path / "episode.npz")
    for name in ARRAY_FIELDS:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(record, name))
    for name in CONTACT_FIELDS:
        np.testing.assert_array_equal(getattr(loaded.contacts, name), getattr(record.contacts, name))
    assert (loaded.ending, loaded.direction, loaded.constants) == (record.ending, record.direction, record.constants)
    assert loaded.reward_terms.keys() == record.reward_terms.keys()
    assert loaded.trace.keys() == record.trace.keys()
    np.testing.assert_array_equal(loaded.policy["action"], record.policy["action"])


def test_the_mesh_of_a_record_comes_back_without_its_file(tmp_path: Path) -> None:
    mesh, _ = read_mesh(write_obj(tmp_path, 0.08 * CUBE))
    replace(episode(steps=3), object_shape=mesh).save(tmp_path / "episode.npz")
    (tmp_path / "object.obj").unlink()
    loaded = EpisodeRecord.load(tmp_path / "episode.npz").object_shape
    assert loaded == mesh
    assert isinstance(loaded, ObjectMesh)
    np.testing.assert_array_equal(loaded.faces, mesh.faces)


@pytest.mark.parametrize("content", [b"", b"not a zip file", b"PK\x03\x04 cut off"])
def test_a_damaged_record_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "episode.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"episode\.npz"):
        EpisodeRecord.load(path)
    with pytest.raises(InputError, match=r"nowhere\.npz"):
        EpisodeRecord.load(tmp_path / "nowhere.npz")
