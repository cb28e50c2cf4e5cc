"""The contact effects by their values, and what each does to the cube in both engines."""

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.drivetrain.model_file import OBJECT_EFFECTS
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World
from tactile_cube.simulation.contact_effects import contact_catalogue, find_any_effect, is_contact_effect

Pair = tuple[Any, Any]
"""What is seen in a world, and what the effect says."""
AWAY, FAR = DLR_HAND2.start_angles, np.array([0.0, 0.0, 3.0])
STATED = EpisodeConstants(tip_friction=0.7, cube_mass=0.2, cube_size=(0.08, 0.06, 0.08), cube_com=(0.0, 0.005, 0.0))
LAWS = (
    ("lateral_friction", {"coefficient": 0.5}, "tip_friction", 0.5),
    ("spinning_friction", {"radius": 0.02}, "tip_spinning_friction", 0.02),
    ("tip_compliance", {"compliance": 3e-4}, "tip_compliance", 3e-4),
    ("object_mass", {"excess": -0.05}, "cube_mass", 0.15),
    ("object_mass", {"excess": -0.3}, "cube_mass", 0.02),  # a tenth always remains
    ("object_com", {"x": 0.01, "y": 0.002, "z": -0.02}, "cube_com", [0.01, 0.007, -0.02]),
    ("object_size", {"excess": 0.002}, "cube_size", [0.082, 0.062, 0.082]),
)


def differing(one: EpisodeConstants, other: EpisodeConstants) -> list[str]:
    return [f.name for f in dataclasses.fields(one) if np.any(getattr(one, f.name) != getattr(other, f.name))]


@pytest.mark.parametrize(("name", "values", "constant", "becomes"), LAWS)
def test_a_contact_effect_changes_its_constant_alone_and_by_its_formula(name, values, constant, becomes) -> None:
    changed = contact_catalogue()[name].apply(STATED, values)
    np.testing.assert_allclose(getattr(changed, constant), becomes, rtol=1e-12)
    assert differing(changed, STATED) == [constant]


@pytest.mark.parametrize("name", OBJECT_EFFECTS)
def test_neutral_values_change_nothing_and_lie_within_the_bounds(name: str) -> None:
    effect = contact_catalogue()[name]
    assert differing(effect.apply(EpisodeConstants(), {}), EpisodeConstants()) == []
    assert all(one.low <= value <= one.high for one in effect.parameters for value in (one.neutral, one.typical))


# --- in the world ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["bullet", "mujoco"])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    world = World(options=SimulationOptions(request.param))
    yield world
    world.close()


def place(world: World, name: str, values: dict[str, float], start: Start, **constants) -> float:
    """Starts an episode with an effect; gives the time of a step [s]."""
    world.reset(contact_catalogue()[name].apply(EpisodeConstants(gravity_scale=0.0, **constants), values), start)
    return world.options.policy_dt


def object_mass(world: World) -> Pair:
    """A push of 0.4 N for one step."""
    dt = place(world, "object_mass", {"excess": 0.03}, Start(AWAY, FAR))
    world.push_cube(np.array([0.4, 0.0, 0.0]), np.zeros(3))
    world.step(AWAY)
    return world.cube_linear_velocity[0], pytest.approx(0.4 * dt / 0.08, rel=1e-3)


def object_com(world: World) -> Pair:
    """A free cube turns about its centre of mass."""
    com, spin = np.array([0.02, -0.01, 0.03]), np.array([0.0, 0.0, 2.0])
    start = Start(AWAY, FAR, cube_angular_velocity=spin)
    dt = place(world, "object_com", dict(zip("xyz", com, strict=True)), start)
    world.step(AWAY)
    moved = com + np.cross(spin, com) * dt - Rotation.from_euler("z", 2.0 * dt).apply(com)
    return world.cube_position - FAR, pytest.approx(moved, abs=1e-5)


def object_size(world: World) -> Pair:
    """A cube pressed onto a table of 2.9 m rests half its height above it."""
    place(world, "object_size", {"excess": 0.006}, Start(AWAY, (0.0, 0.0, 2.944)), table_height=2.9)
    world.push_cube(np.array([0.0, 0.0, -0.5]), np.zeros(3))
    for _ in range(10):
        world.step(AWAY)
    return world.cube_position[2], pytest.approx(2.9 + 0.043, abs=3e-4)


def tip_compliance(world: World) -> Pair:
    """Squeezing tips sink in by force times compliance."""
    place(world, "tip_compliance", {"compliance": 3e-4}, Start(AWAY))
    for _ in range(40):
        world.step(grasp_angles(DLR_HAND2, [0.08] * 3, [0, 0, 0], [0, 0, 0, 1], -0.01))
    contacts = [contact for contact in world.contacts() if contact.other == "cube" and contact.force > 0.1]
    assert len(contacts) >= 4
    return [-one.distance for one in contacts], pytest.approx([3e-4 * one.force for one in contacts], rel=0.15)


MOTIONS: dict[str, Callable[[World], Pair]] = {
    function.__name__: function for function in (object_mass, object_com, object_size, tip_compliance)
}
IN_CONTACT_FRICTION = {"lateral_friction", "spinning_friction"}


@pytest.mark.parametrize("name", list(MOTIONS))
def test_the_cube_moves_as_the_effect_says(world: World, name: str) -> None:
    found, wanted = MOTIONS[name](world)
    assert found == wanted


def test_every_contact_effect_has_a_law_and_a_motion() -> None:
    every = {(name, one.name) for name, effect in contact_catalogue().items() for one in effect.parameters}
    assert {(name, key) for name, values, *_ in LAWS for key in values} == every
    assert MOTIONS.keys() | IN_CONTACT_FRICTION == contact_catalogue().keys()
    assert tuple(contact_catalogue()) == OBJECT_EFFECTS


# --- names -----------------------------------------------------------------------------------------------------------


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(InputError, match="lateral_friction: no parameter 'mu'; it has coefficient"):
        contact_catalogue()["lateral_friction"].apply(STATED, {"mu": 0.5})


def test_names_of_either_kind_are_found() -> None:
    assert is_contact_effect("object_mass")
    assert not is_contact_effect("backlash@q2")
    assert find_any_effect("object_mass") is contact_catalogue()["object_mass"]
    assert find_any_effect("backlash").name == "backlash"
