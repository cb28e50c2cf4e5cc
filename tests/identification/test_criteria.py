"""What decides stands in one place: the configuration says what the code takes by itself."""

import gzip
import json
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from benchmarks.regression.evidence import decided
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


EVIDENCE = json.loads(gzip.decompress(Path(__file__).with_name("evidence.json.gz").read_bytes()))
"""What held-out trials said of a dozen spent draws of benchmarks/regression, and the answer to each."""
DECIDING = ("floor", "adequate", "tolerated", "least_gain", "detail", "band", "significant", "most", "nearly_whole")


def missed(criteria: Criteria) -> list[str]:
    """Draws whose answer these criteria change."""
    return [
        seed
        for seed, table in EVIDENCE.items()
        if decided(table["evidence"], criteria) != (table["verdict"], table["named"])
    ]


def test_a_dozen_recordings_with_known_answers_are_answered_by_what_was_measured_of_them() -> None:
    assert len(EVIDENCE) >= 12
    assert len({table["verdict"] for table in EVIDENCE.values()}) >= 4
    assert missed(STANDARD) == []


@pytest.mark.parametrize("name", DECIDING)
def test_each_deciding_number_decides_twice_or_half_of_it_changes_an_answer(name: str) -> None:
    number = getattr(STANDARD, name)
    assert missed(replace(STANDARD, **{name: 2.0 * number})) or missed(replace(STANDARD, **{name: 0.5 * number}))
