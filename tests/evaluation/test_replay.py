import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.env import RotationEnv
from tactile_cube.evaluation.evaluation import DisplacedStart


def displacement(env: RotationEnv, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Shift (3,) [m] and rotation vector (3,) [rad] of the cube by the displaced start of a seed."""
    env.reset()
    before = env.world.start
    DisplacedStart(seed, 5e-4)(env, 0)
    after = env.world.start
    np.testing.assert_array_equal(after.angles, before.angles)
    assert env.world.constants is env.constants
    turn = Rotation.from_quat(after.cube_quaternion) * Rotation.from_quat(before.cube_quaternion).inv()
    return after.cube_position - before.cube_position, turn.as_rotvec()


def test_the_cube_starts_half_a_millimetre_and_a_hundredth_of_a_radian_aside(scripted_world, rotation_task) -> None:
    env = rotation_task(scripted_world())
    shift, turn = (np.array(rows) for rows in zip(*(displacement(env, seed) for seed in range(200)), strict=True))
    np.testing.assert_allclose(shift.std(axis=0), [5e-4, 5e-4, 0.0], rtol=0.2)
    np.testing.assert_allclose(turn.std(axis=0), [0.0, 0.0, 0.01], rtol=0.2, atol=1e-9)
    assert np.abs(shift.mean(axis=0)).max() < 2e-4, "to either side"


def test_the_cube_is_displaced_once_and_equally_by_equal_seeds(scripted_world, rotation_task) -> None:
    env = rotation_task(scripted_world())
    np.testing.assert_array_equal(displacement(env, 3), displacement(env, 3))
    later = env.world.start
    DisplacedStart(3, 5e-4)(env, 1)
    assert env.world.start is later
