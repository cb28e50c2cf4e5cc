import numpy as np
import pytest

from tactile_cube.hand.object_mesh import ObjectShape, tip_centres, unit_inertia

HALF = np.array([0.04, 0.04, 0.05])
SIDE = np.array([0.866, 0.5, 0.0])


@pytest.mark.parametrize("shape", ["cylinder", "capsule"])
def test_tips_stand_off_a_round_side(shape: ObjectShape) -> None:
    centres = tip_centres(shape, SIDE, HALF, 0.012, 0.001)
    np.testing.assert_allclose(np.hypot(centres[:, 0], centres[:, 1]), 0.053)
    np.testing.assert_allclose(centres[0], [*0.053 * SIDE[:2], 0.0], atol=1e-5)


def test_on_a_box_the_face_is_the_one_that_the_side_points_through() -> None:
    centres = tip_centres("box", SIDE, HALF, 0.012, 0.001)
    np.testing.assert_allclose(centres[:, 0], 0.053)
    assert centres[0, 1] == pytest.approx(0.04 * 0.5 / 0.866, abs=0.004)  # the grid's step


@pytest.mark.parametrize("shape", ["box", "cylinder", "capsule"])
@pytest.mark.parametrize("size", [(0.08, 0.08, 0.08), (0.06, 0.06, 0.15)])
def test_inertia_is_that_of_the_points_inside(shape: ObjectShape, size: tuple[float, ...]) -> None:
    middles = (np.arange(80) + 0.5) / 80 - 0.5
    points = np.stack(np.meshgrid(middles, middles, middles), axis=-1).reshape(-1, 3) * size
    radius, straight = size[0] / 2, max(size[2] - size[0], 0.0) / 2
    beyond = np.maximum(np.abs(points[:, 2]) - straight, 0.0) if shape == "capsule" else 0.0
    inside = points[(shape == "box") | (np.hypot(np.hypot(points[:, 0], points[:, 1]), beyond) < radius)]
    moments = inside.T @ inside / len(inside)
    expected = np.trace(moments) * np.eye(3) - moments
    np.testing.assert_allclose(unit_inertia(shape, np.array(size)), expected, rtol=3e-3, atol=1e-9)
