"""A mesh as object: its size, mass and inertia, where fingertips stand, and what is refused."""

import os
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand.object_mesh import CORNERS, ObjectShape, read_mesh, tip_centres, unit_inertia
from tactile_cube.simulation import constants_of
from tests.meshes import CUBE, write_hollow, write_obj, write_stl

SIZE = np.array([0.08, 0.06, 0.1])


@pytest.mark.parametrize("write", [write_obj, write_stl])
def test_a_box_as_mesh_has_a_boxs_size_mass_inertia_and_fingertips(write: object, tmp_path: Path) -> None:
    mesh, size = read_mesh(write(tmp_path, 1e3 * SIZE * CUBE + [5.0, 7.0, -3.0]), scale=1e-3)  # type: ignore[operator]
    np.testing.assert_allclose(size, SIZE, rtol=1e-6)
    np.testing.assert_allclose(mesh.com, 0.0, atol=1e-6)
    assert mesh.volume == pytest.approx(1.0, rel=1e-5)
    np.testing.assert_allclose(unit_inertia(mesh, size), unit_inertia("box", size), atol=1e-8)
    side = np.array([0.0, -1.0, 0.0])
    first = tip_centres(mesh, side, 0.5 * size, 0.012, 0.001)[0]
    np.testing.assert_allclose(first, tip_centres("box", side, 0.5 * size, 0.012, 0.001)[0], atol=1e-6)


def test_a_wedge_is_heavier_where_it_is_thicker(tmp_path: Path) -> None:
    wedge = np.array([corner for corner in CUBE if not (corner[0] > 0 and corner[2] > 0)])  # cut off above at +x
    described = {"shape": "mesh", "file": write_obj(tmp_path, 0.09 * wedge), "density": 500.0, "mass": None}
    constants = constants_of(None, described)
    assert constants.cube_mass == pytest.approx(500.0 * 0.5 * 0.09**3)
    np.testing.assert_allclose(constants.cube_com, [-0.015, 0.0, -0.015], atol=1e-6)  # a third of the edge


def test_fingertips_stand_off_an_octahedrons_slopes(tmp_path: Path) -> None:
    corners = 0.05 * np.vstack([np.eye(3), -np.eye(3)])
    mesh, size = read_mesh(write_obj(tmp_path, corners))
    centres = tip_centres(mesh, np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0]), 0.5 * size, 0.012, 0.002)
    to_slopes = np.abs(centres).sum(axis=1) / np.sqrt(3.0) - 0.05 / np.sqrt(3.0)
    np.testing.assert_allclose(to_slopes, 0.014, atol=1e-6)


def test_of_a_fine_mesh_few_corners_are_kept_and_its_size_stays(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(1500, 3))
    file = write_obj(tmp_path, 0.04 * points / np.linalg.norm(points, axis=1)[:, None])
    mesh, size = read_mesh(file)
    assert len(mesh.vertices) <= CORNERS
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), 1.0)
    radii = np.linalg.norm(mesh.vertices * size, axis=1)
    assert radii.min() > 0.039
    np.testing.assert_allclose(np.diag(unit_inertia(mesh, size)), 0.4 * 0.04**2, rtol=0.02)


@pytest.mark.parametrize(
    ("unit", "hint"),
    [(1e3, r"in millimetres it needs object\.scale=0\.001"), (1e2, r"in centimetres it needs object\.scale=0\.01")],
)
def test_a_mesh_in_another_unit_is_noticed(unit: float, hint: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"is .* m with object\.scale=1 .*{hint}"):
        read_mesh(write_obj(tmp_path, 0.08 * unit * CUBE))


def test_a_hollow_mesh_is_refused_until_its_hull_is_asked_for_and_keeps_its_own_inertia(tmp_path: Path) -> None:
    file = write_hollow(tmp_path)
    with pytest.raises(InputError, match=r"fills 86 % of its convex hull.*object\.hull=true"):
        read_mesh(file)
    mesh, size = read_mesh(file, hull=True)
    assert mesh.volume == pytest.approx(0.75, rel=1e-6)
    np.testing.assert_allclose(mesh.com * size, [-0.02 / 3, -0.02 / 3, 0.0], atol=1e-6)
    bars = np.array([[-0.02, -0.02], [0.02, -0.02], [-0.02, 0.02]]) + 0.02 / 3  # about the centre of mass
    apart = (bars[:, :, None] * bars[:, None, :]).mean(axis=0)
    moments = np.diag([0.04**2, 0.04**2, 0.08**2]) / 12  # of one bar
    moments[:2, :2] += apart
    np.testing.assert_allclose(unit_inertia(mesh, size), np.trace(moments) * np.eye(3) - moments, atol=1e-9)


def test_an_open_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its surface is not closed"):
        read_mesh(write_obj(tmp_path, 0.08 * CUBE, leave_out=2))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("gone.obj", None, "no such file; a relative name is looked for in"),
        ("object.step", "ISO-10303-21;", r"ending '\.step' is unknown; give a mesh as \.obj or \.stl"),
        ("pipe.stl", None, "is a pipe; a regular file is needed here"),
        ("broken.obj", "v 0 0 zero\n", "no mesh could be read from it"),
        ("empty.stl", "", "no mesh could be read from it"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no mesh could be read from it"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_line(name: str, content: str | None, message: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    if name == "pipe.stl":
        os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=message) as error:
        read_mesh(tmp_path / name)
    assert "\n" not in str(error.value)
    assert name in str(error.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, r"object=mesh needs object\.file=FILE"),
        ({"file": "a.obj", "mass": None}, "mass is None, density is None; give one"),
        ({"file": "a.obj", "size": [0.1] * 3}, r"object\.size: no such setting of a mesh"),
    ],
)
def test_settings_that_do_not_fit_a_mesh_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        constants_of(None, {"shape": "mesh", "mass": 0.05} | settings)


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
