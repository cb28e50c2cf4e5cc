from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tactile_cube.hand.object_mesh import ObjectShape, read_mesh
from tactile_cube.visualization.episode_recording import MAX_BYTES, write_film
from tactile_cube.visualization.scene import BELOW, SIDE, Scene
from tests.evaluation.synthetic import episode
from tests.meshes import CUBE, write_obj


@pytest.mark.parametrize(("steps", "frames"), [(40, 21), (1000, 201)], ids=["in real time", "thinned out"])
def test_a_film_shows_five_frames_a_second_and_stays_small(steps: int, frames: int, tmp_path: Path) -> None:
    write_film(episode(steps=steps), tmp_path / "film.gif", view=32)
    with Image.open(tmp_path / "film.gif") as film:
        assert (film.n_frames, film.info["duration"]) == (frames, 200)
    assert (tmp_path / "film.gif").stat().st_size < MAX_BYTES


@pytest.mark.parametrize("camera", [SIDE, BELOW])
def test_a_quarter_turn_can_be_seen(camera: object) -> None:
    """The faces look alike in shape; only their colours tell a quarter turn from none."""
    record = episode()
    scene = Scene(record.cube_size)
    pictures = []
    for angle in (0.0, np.pi / 2):
        scene.pose(record.joint_position[0], np.zeros(3), np.array([0.0, 0.0, np.sin(angle / 2), np.cos(angle / 2)]))
        pictures.append(np.asarray(scene.picture(camera, 64, 64), dtype=float))  # type: ignore[arg-type]
    scene.close()
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=2) > 40) > 0.02


@pytest.mark.parametrize("camera", [SIDE, BELOW])
def test_a_mesh_is_drawn_where_a_box_of_its_size_is(camera: object, tmp_path: Path) -> None:
    record = episode()
    mesh, _ = read_mesh(write_obj(tmp_path, 0.08 * CUBE))
    filled, shapes = [], list[ObjectShape](["box", mesh])
    for shape in shapes:
        scene = Scene(np.full(3, 0.08), shape=shape)
        scene.pose(record.joint_position[0], np.array([0.0, 0.0, -0.1]), np.array([0.0, 0.0, 0.0, 1.0]))
        picture = np.asarray(scene.picture(camera, 64, 64))  # type: ignore[arg-type]
        filled.append(picture.min(axis=2) < 250)
        scene.close()
    assert filled[0].mean() > 0.1
    assert np.mean(filled[0] != filled[1]) < 0.02
