import pytest

from tactile_cube.errors import InputError
from tests.drivetrain.effects.laws import CableDrag


def test_parameters_not_given_are_typical() -> None:
    assert CableDrag("q1", drag=0.3).values == {"stiffness": 0.1, "drag": 0.3}


def test_an_effect_reads_as_what_it_is() -> None:
    assert repr(CableDrag("q1", drag=0.3)) == "CableDrag('q1', stiffness=0.1, drag=0.3)"


@pytest.mark.parametrize(
    ("values", "complaint"),
    [({"mass": 1.0}, "no parameter 'mass'; it has stiffness, drag"), ({"drag": float("nan")}, "drag is nan")],
)
def test_values_that_make_no_sense_are_refused(values, complaint) -> None:
    with pytest.raises(InputError, match=complaint):
        CableDrag("q1", **values)
