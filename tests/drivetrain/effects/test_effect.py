import pytest

from tactile_cube.drivetrain.effects import Effect, Stage
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


@pytest.mark.parametrize(
    ("parts", "complaint"),
    [
        ({"stage": Stage.FRICTION, "parameters": ()}, "test_effect.Own lacks name$"),
        ({"name": "own", "stage": Stage.FRICTION, "parameters": ()}, r"lacks a static method law\(x, j, p, s, dt\)"),
        (
            {"name": "own", "stage": Stage.MECHANISM, "parameters": ()},
            r"lacks a static method configure\(view, place, p\)",
        ),
    ],
)
def test_a_class_without_what_its_stage_asks_for_cannot_be_defined(parts, complaint) -> None:
    with pytest.raises(InputError, match=complaint):
        type("Own", (Effect,), {"__module__": __name__, **parts})
