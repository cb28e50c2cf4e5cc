import numpy as np
import pytest

from tactile_cube.hand.object_shape import ObjectShape, tip_centres, unit_inertia

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


def test_a_capsule_as_high_as_wide_is_a_sphere() -> None:
    np.testing.assert_allclose(unit_inertia("capsule", np.full(3, 0.08)), 0.4 * 0.04**2 * np.eye(3))


def test_a_long_capsule_is_nearly_a_thin_rod() -> None:
    assert unit_inertia("capsule", np.array([0.001, 0.001, 1.0]))[0, 0] == pytest.approx(1 / 12, rel=2e-3)


def test_inertia_of_cylinder_and_box() -> None:
    np.testing.assert_allclose(unit_inertia("cylinder", np.array([0.08, 0.08, 0.1]))[2, 2], 0.5 * 0.04**2)
    np.testing.assert_allclose(unit_inertia("box", np.array([0.1, 0.2, 0.3])), np.diag([0.13, 0.10, 0.05]) / 12)
