"""What decides stands in one place: the configuration says what the code takes by itself."""

from pathlib import Path

import yaml

from tactile_cube.command_help import CONFIG
from tactile_cube.identification.criteria import STANDARD, Criteria


def test_the_standard_criteria_are_those_of_the_configuration_each_with_its_reason() -> None:
    text = (Path(CONFIG) / "criteria" / "standard.yaml").read_text()
    assert Criteria(**yaml.safe_load(text)) == STANDARD
    assert all(" # " in line for line in text.splitlines()[1:])
