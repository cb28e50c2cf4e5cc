"""A mesh as object moves as what it describes, in both engines."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, constants_of
from tactile_cube.simulation.engine import EngineName
from tests.meshes import CUBE, write_obj

BOX = {"shape": "box", "size": [0.08] * 3, "mass": 0.05}
ENGINES = ("bullet", "mujoco")


def turned(world: World, object_: dict[str, Any], table: bool) -> tuple[np.ndarray, float]:
    """Where the object is [m], and how far it has turned [rad], after fingers have held and turned it for 2 s."""
    height = -0.04 if table else None
    world.reset(constants_of(None, object_, filter_time=0.12, table_height=height), Start(DLR_HAND2.start_angles))
    goal = grasp_angles(DLR_HAND2, [0.08] * 3, [0, 0, 0], [0, 0, 0, 1], -0.01)
    for _ in range(20):
        world.step(goal)
        goal[[0, 3, 6, 9]] -= 0.02
    assert world.healthy
    return np.array(world.cube_position), float(Rotation.from_quat(world.cube_quaternion).as_euler("ZYX")[0])


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_cube_as_mesh_is_turned_as_the_box_is(engine: EngineName, table: bool, tmp_path: Path) -> None:
    """Within 1.5 mm and 0.03 rad after 2 s: the engines find the contacts of a mesh in another way than a box's."""
    mesh = {"shape": "mesh", "file": str(write_obj(tmp_path, 0.08 * CUBE)), "mass": 0.05}
    world = World(options=SimulationOptions(engine))
    place, angle = turned(world, BOX, table)
    as_mesh, angle_as_mesh = turned(world, mesh, table)
    assert angle > 0.2
    assert np.linalg.norm(as_mesh - place) < 1.5e-3
    assert abs(angle_as_mesh - angle) < 0.03
    again, angle_again = turned(world, BOX, table)  # nothing of the mesh remains
    assert (again.tolist(), angle_again) == (place.tolist(), angle)
    world.close()


def tumbled(engine: EngineName, constants: EpisodeConstants, quaternion: np.ndarray) -> Rotation:
    """The orientation of an object that flew and turned freely for 0.5 s."""
    world = World(options=SimulationOptions(engine))
    flight = Start(DLR_HAND2.start_angles, (0.0, 0.0, 2.0), quaternion, cube_angular_velocity=(4.0, 2.0, 3.0))
    world.reset(constants, flight)
    for _ in range(5):
        world.step(DLR_HAND2.start_angles)
    orientation = Rotation.from_quat(world.cube_quaternion)
    world.close()
    return orientation


def test_a_bar_that_lies_askew_in_its_mesh_tumbles_as_the_bar_does_and_bullet_says_that_it_cannot(tmp_path) -> None:
    size, askew = np.array([0.12, 0.04, 0.03]), Rotation.from_euler("z", 0.5)
    bar = constants_of(None, {"shape": "box", "size": size.tolist(), "mass": 0.05}, gravity_scale=0.0)
    file = str(write_obj(tmp_path, askew.apply(size * CUBE)))
    mesh = constants_of(None, {"shape": "mesh", "file": file, "mass": 0.05}, gravity_scale=0.0)
    expected = tumbled("mujoco", bar, askew.as_quat()) * askew.inv()
    found = tumbled("mujoco", mesh, np.array([0.0, 0.0, 0.0, 1.0]))
    assert (found * expected.inv()).magnitude() < 1e-3
    assert found.magnitude() > 0.5
    with pytest.raises(InputError, match=r"products of inertia are 0.99 of its smallest moment, engine=bullet"):
        tumbled("bullet", mesh, np.array([0.0, 0.0, 0.0, 1.0]))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pyramid_turns_about_its_own_centre_of_mass(engine: EngineName, tmp_path: Path) -> None:
    """The middle of its bounding box circles around that: a quarter of its height above the base."""
    pyramid = np.vstack([CUBE[:4], [[0.5, 0.0, 0.0]]])
    described = {"shape": "mesh", "file": str(write_obj(tmp_path, 0.08 * pyramid)), "mass": 0.05}
    constants = constants_of(None, described, gravity_scale=0.0)
    com, spin = np.array(constants.cube_com), np.array([0.0, 0.0, 4.0])
    np.testing.assert_allclose(com, [-0.02, 0.0, 0.0], atol=1e-6)
    velocity = -np.cross(spin, com)
    start = Start(DLR_HAND2.start_angles, (0, 0, 2), cube_linear_velocity=velocity, cube_angular_velocity=spin)
    world = World(options=SimulationOptions(engine))
    world.reset(constants, start)
    for _ in range(5):
        world.step(DLR_HAND2.start_angles)
    rotation = Rotation.from_quat(world.cube_quaternion)
    middle = np.array([0.0, 0.0, 2.0]) + com - rotation.apply(com)
    np.testing.assert_allclose(world.cube_position, middle, atol=3e-4)  # the step's error; the way is 33 mm
    assert rotation.magnitude() > 1.5
    world.close()
