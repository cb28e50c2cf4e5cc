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
STRENGTHS = (2.0, 1.0, 0.4, 0.2, 0.1, 0.05)  # of what is hidden, in units of what was
SHOWS = 1.1  # [sensor noise] error of the model with refitted constants from which on something shows
ADEQUATE = ("adequate", [])
DECIDING = ("floor", "adequate", "least_gain", "detail", "band", "significant", "most", "nearly_whole")
"""`tolerated` decides in test_verdict, `margin` in test_safe_commands, `most_simulated` in search/test_findings."""


def missed(criteria: Criteria) -> list[tuple[str, float]]:
    """Draws and strengths that are answered otherwise than by what is hidden, or by nothing where it does not show.

    What is weaker than it was may be named beside more that these data cannot tell from it.
    """
    found = []
    for seed, table in EVIDENCE.items():
        for strength in STRENGTHS:
            kind, named, error = decided(table["evidence"], criteria, strength)
            verdict, sets = (table["verdict"], table["named"]) if error > SHOWS else ADEQUATE
            others = [one for one in named if one not in sets] if strength < 1.0 else []
            found += [(seed, strength)] if (kind, named) != (verdict, [*sets, *others]) else []
    return found


def test_a_dozen_recordings_with_known_answers_are_answered_by_what_was_measured_of_them() -> None:
    assert len(EVIDENCE) >= 12
    assert {table["verdict"] for table in EVIDENCE.values()} >= {"adequate", "missing_effect", "ambiguous"}
    assert missed(STANDARD) == []


@pytest.mark.parametrize("name", DECIDING)
def test_twice_or_half_of_each_deciding_number_misses_an_answer(name: str) -> None:
    number = getattr(STANDARD, name)
    assert missed(replace(STANDARD, **{name: 2.0 * number})) or missed(replace(STANDARD, **{name: 0.5 * number}))
