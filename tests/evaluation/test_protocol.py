from typing import Any

import pytest

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.errors import InputError
from tactile_cube.evaluation.protocol import Protocol


@pytest.mark.parametrize(
    "wrong",
    [{"episodes": 0}, {"seconds": -1.0}, {"variants": ()}, {"film": -1}, {"worlds": "x"}],
)
def test_impossible_protocols_are_refused_by_key(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"protocol.{next(iter(wrong))}"):
        Protocol("x", **wrong)


def test_the_catalogue_adds_one_variant_for_each_effect() -> None:
    conditions = Protocol("x", catalogue=True).conditions
    assert len(conditions) == 1 + len(catalogue())
    assert {name for variant in conditions for name in variant.effects} == set(catalogue())
