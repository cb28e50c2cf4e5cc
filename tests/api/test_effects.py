"""The catalogue in words: every effect says what it is, what it looks like in data and what it is confused with."""

import re
from pathlib import Path

import pytest

import tactile_cube
from tactile_cube.api.effects import EffectDescription, effects_table
from tactile_cube.errors import InputError
from tests.typed import typed

EVERY = tactile_cube.effects()
NAMES = {one.name for one in EVERY}


@pytest.mark.parametrize("effect", EVERY, ids=lambda one: one.name)
def test_an_effect_describes_itself(effect: EffectDescription) -> None:
    assert effect.summary.endswith(".")
    assert effect.law
    assert {"In data", "Confused with"} <= effect.notes.keys()
    assert effect.notes.get("Source") or all(parameter.source for parameter in effect.parameters)
    named = set(re.findall(r"`(\w+)`", effect.notes["Confused with"] + effect.notes.get("Special cases", "")))
    assert named <= NAMES - {effect.name}


def test_a_description_shows_law_parameters_signature_and_source() -> None:
    (stiction,) = tactile_cube.effects("stribeck_friction")
    assert "F += excess * exp(-|v / velocity|^exponent)" in stiction.law
    assert stiction.rows[1] == ("velocity", "rad/s", "0.15", "0.15", "0.01 to 3", "0.05-0.3 rad/s")
    for part in (stiction.summary, stiction.law, "In data: spikes after standstill", "Source: Armstrong"):
        assert part in stiction.text


def test_numbered_parameters_that_are_alike_share_a_row_and_limits_may_be_infinite() -> None:
    (profile,), (stop,) = tactile_cube.effects("position_torque"), tactile_cube.effects("joint_stop")
    assert [row[0] for row in profile.rows] == ["stiffness", "bias", "first", "last", "torque_0 to torque_16"]
    assert stop.rows[1][2:5] == ("-inf", "-inf", "-inf to 7")


def test_the_table_has_every_effect_with_its_ranges() -> None:
    lines = effects_table(EVERY).splitlines()
    assert {line.partition(":")[0] for line in lines if line and not line.startswith(" ")} >= NAMES
    assert "    velocity  0.01 to 3 rad/s" in lines
    assert "    exponent  0.3 to 4" in lines


def test_a_misspelt_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"'stribek_friction' is unknown.*; did you mean stribeck_friction\?$"):
        tactile_cube.effects("stribek_friction")


@pytest.mark.parametrize(
    ("words", "status", "shown"), [((), 0, "backlash: Play"), (("name=mass",), 2, "error: effect")]
)
def test_the_command_prints_or_says_what_is_wrong(words, status, shown, tmp_path: Path) -> None:
    run = typed("effects", *words, folder=tmp_path)
    assert run.returncode == status
    assert shown in (run.stderr if status else run.stdout)
