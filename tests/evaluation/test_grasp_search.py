from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tactile_cube
from tactile_cube.errors import InputError
from tactile_cube.evaluation import grasp_search
from tactile_cube.evaluation.grasp_search import find_grasps
from tactile_cube.hand import DLR_HAND2, tip_positions
from tactile_cube.randomization import GraspStarts
from tactile_cube.simulation import EpisodeConstants, World

CONSTANTS = EpisodeConstants(tip_spinning_friction=0.003)


def test_found_grasps_touch_with_three_tips_and_equal_seeds_find_equal_ones() -> None:
    one, two = (find_grasps(World(), CONSTANTS, 4, seed=1) for _ in range(2))
    assert np.array_equal(one.angles, two.angles)
    assert np.array_equal(one.targets, two.targets)
    for angles, position, quaternion in zip(one.angles, one.positions, one.quaternions, strict=True):
        tips = Rotation.from_quat(quaternion).inv().apply(tip_positions(DLR_HAND2, angles) - position)
        gaps = np.linalg.norm(np.maximum(np.abs(tips) - 0.04, 0.0), axis=1) - DLR_HAND2.tip_radius
        assert np.sum(gaps < 5e-4) >= 3
    assert np.all(np.linalg.norm(one.positions, axis=1) < grasp_search.SHIFTED)


def test_what_the_fingers_cannot_bear_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grasp_search, "TRIES", 6)
    slippery = EpisodeConstants(tip_friction=0.01, tip_spinning_friction=0.0)
    with pytest.raises(InputError, match="0 of 1 grasps held in 6 tries"):
        find_grasps(World(), slippery, 1, seed=0)


def test_no_grasps_wanted_is_refused() -> None:
    with pytest.raises(InputError, match="grasps is 0"):
        find_grasps(World(), CONSTANTS, 0, seed=0)


def test_a_program_searches_grasps_of_its_object_and_starts_in_them(tmp_path: Path) -> None:
    found = tactile_cube.search_grasps(tactile_cube.env_config(object="cylinder"), grasps=2, seed=1)
    found.save(tmp_path / "grasps.npz")
    starts = GraspStarts(str(tmp_path / "grasps.npz"))
    config = tactile_cube.env_config(object="cylinder")
    assert len(starts.of(config.hand, config.constants).grasps.angles) == 2
    assert found.origin["command"] == "tactile_cube.search_grasps(config, grasps=2, seed=1)"
