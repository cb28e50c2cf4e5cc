import dataclasses

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import OBJECT_EFFECTS
from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants
from tactile_cube.simulation.contact_effects import (
    LateralFriction,
    ObjectMass,
    ObjectSize,
    contact_catalogue,
    find_any_effect,
    is_contact_effect,
)


def test_the_catalogue_holds_what_the_model_file_knows_as_effects_of_the_object() -> None:
    assert tuple(contact_catalogue()) == OBJECT_EFFECTS


@pytest.mark.parametrize("name", OBJECT_EFFECTS)
def test_neutral_values_change_nothing(name: str) -> None:
    constants = EpisodeConstants()
    neutral = contact_catalogue()[name].apply(constants, {})
    for field in dataclasses.fields(constants):
        np.testing.assert_array_equal(getattr(neutral, field.name), getattr(constants, field.name))


@pytest.mark.parametrize("name", OBJECT_EFFECTS)
def test_typical_values_change_one_constant_alone(name: str) -> None:
    effect, constants = contact_catalogue()[name], EpisodeConstants()
    changed = effect.apply(constants, {one.name: one.typical for one in effect.parameters})
    fields = [field.name for field in dataclasses.fields(constants)]
    assert [key for key in fields if np.any(getattr(changed, key) != getattr(constants, key))] == [effect.constant]


@pytest.mark.parametrize("name", OBJECT_EFFECTS)
def test_bounds_hold_neutral_and_typical_values(name: str) -> None:
    for one in contact_catalogue()[name].parameters:
        assert one.low <= one.neutral <= one.high
        assert one.low <= one.typical <= one.high


def test_friction_replaces_and_mass_and_size_add() -> None:
    stated = EpisodeConstants(tip_friction=0.7, cube_mass=0.2, cube_size=(0.08, 0.06, 0.08))
    assert LateralFriction.apply(stated, {"coefficient": 0.5}).tip_friction == 0.5
    assert ObjectMass.apply(stated, {"excess": -0.05}).cube_mass == pytest.approx(0.15)
    np.testing.assert_allclose(ObjectSize.apply(stated, {"excess": 0.002}).cube_size, [0.082, 0.062, 0.082])


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(InputError, match="lateral_friction: no parameter 'mu'; it has coefficient"):
        LateralFriction.apply(EpisodeConstants(), {"mu": 0.5})


def test_names_of_either_kind_are_found() -> None:
    assert is_contact_effect("object_mass")
    assert not is_contact_effect("backlash@q2")
    assert find_any_effect("object_mass") is ObjectMass
    assert find_any_effect("backlash").name == "backlash"
