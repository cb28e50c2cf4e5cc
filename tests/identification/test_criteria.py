"""What decides stands in one place: the configuration says what the code takes by itself."""

from pathlib import Path

import pytest
import yaml

from tactile_cube.composition import CONFIG
from tactile_cube.errors import InputError
from tactile_cube.identification.criteria import STANDARD, Criteria


def test_the_standard_criteria_are_those_of_the_configuration_each_with_its_reason() -> None:
    text = (Path(CONFIG) / "criteria" / "standard.yaml").read_text()
    assert Criteria(**yaml.safe_load(text)) == STANDARD
    assert all(" # " in line for line in text.splitlines()[1:])


@pytest.mark.parametrize("margin", [-0.1, 1.0, float("nan")])
def test_a_margin_that_lets_a_command_leave_the_limits_is_refused(margin: float) -> None:
    with pytest.raises(InputError, match=r"criteria\.margin"):
        Criteria(margin=margin)
