from pathlib import Path

import pytest

from tactile_cube.drivetrain.effects import (
    Effect,
    Stage,
    catalogue,
    find_effect,
    import_own_effects,
    matching_joints,
    resolve,
)
from tactile_cube.drivetrain.effects.friction import StribeckFriction
from tactile_cube.errors import InputError
from tests.drivetrain.effects.laws import CableDrag

HAND = ("ring_q1", "ring_q2", "thumb_q1", "thumb_q2")


def test_names_are_found_in_the_catalogue_and_by_dotted_path() -> None:
    assert find_effect("stribeck_friction") is StribeckFriction
    assert find_effect("tests.drivetrain.effects.laws.CableDrag") is CableDrag


def test_an_effect_is_placed_on_the_joint_named_after_the_at_or_on_all() -> None:
    assert resolve(["stribeck_friction@q2"], ("q1", "q2")) == [(StribeckFriction, "q2")]
    assert resolve(["stribeck_friction"], ("q1", "q2")) == [(StribeckFriction, "q1"), (StribeckFriction, "q2")]


def test_a_finger_s_joint_stands_for_that_joint_of_every_finger() -> None:
    assert matching_joints("q2", HAND) == ["ring_q2", "thumb_q2"]
    assert matching_joints("ring_q2", HAND) == ["ring_q2"]


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("striebeck_friction", r"'striebeck_friction' is unknown; did you mean stribeck_friction\?$"),
        ("stribeck", r"did you mean stribeck_friction\?$"),
        ("quux", "'quux' is unknown; use one of command_dead_zone, rate_limit, .* or a dotted path"),
        ("no_such_rig.Drag", "whose code no file can have run"),
        ("tests.drivetrain.effects.laws.Nothing", "no subclass of Effect named 'Nothing'"),
        ("tests.drivetrain.effects.laws.NOT_AN_EFFECT", "no subclass of Effect"),
        ("stribeck_friction@q9", "joint 'q9' is unknown; the joints are q1, q2"),
        ("stribeck_friction@q22", r"joint 'q22' is unknown; the joints are q1, q2; did you mean q2\?$"),
        ("stribeck_friction@", "joint '' is unknown"),
    ],
)
def test_what_cannot_be_found_is_named(name: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        resolve([name], ("q1", "q2"))


def test_nothing_is_imported_for_a_name_until_the_user_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "drag_of_mine.py").write_text("from tests.drivetrain.effects.laws import CableDrag\nopen('ran', 'w')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"own_effects=\[drag_of_mine\.CableDrag\]"):
        resolve(["drag_of_mine.CableDrag@q2"], ("q1", "q2"))
    assert not (tmp_path / "ran").exists()
    import_own_effects(["backlash", "drag_of_mine.CableDrag@q2: tension=0.1"])
    assert (tmp_path / "ran").exists()
    assert resolve(["drag_of_mine.CableDrag@q2"], ("q1", "q2")) == [(CableDrag, "q2")]


def test_a_module_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="cannot import 'no_such_rig'"):
        import_own_effects(["no_such_rig.Drag"])


BROKEN = """
from tactile_cube.drivetrain.effects import Effect, Parameter, Stage

class Mine(Effect):
    name, stage = "mine", Stage.JOINT_TORQUE
    parameters = (Parameter("a", unit="N m", neutral=0.0, low=0.0, high=1.0, typical=0.1, source="test"),)

    @staticmethod
    def law(x, j, p, s{dt}):
        return {law}
"""


@pytest.mark.parametrize(
    ("law", "dt", "said"),
    [
        ("x[SPEED, j]", ", dt", "NameError: name 'SPEED' is not defined"),
        ("x[0, j] + p[3]", ", dt", "IndexError: index 3 is out of bounds"),
        ("x[0, j]", "", "TypeError: .*takes 4 positional arguments"),
        ("x[Stage.JOINT_TORQUE.value, j] + {}.get(j, 0.0)", ", dt", "TypingError: "),
        ("x[Stage.JOINT_TORQUE.value, j] - p[0] - 0.5", ", dt", "with neutral parameters; it must change nothing"),
    ],
)
def test_a_law_of_ones_own_that_cannot_be_used_is_refused_in_one_line(law, dt, said, tmp_path, monkeypatch) -> None:
    module = f"broken_{tmp_path.name}"
    (tmp_path / f"{module}.py").write_text(BROKEN.format(law=law, dt=dt))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=rf"effect '{module}.Mine': law\(x, j, p, s, dt\).*{said}") as caught:
        import_own_effects([f"{module}.Mine"])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", list(catalogue()))
def test_every_effect_describes_itself(name: str) -> None:
    effect = catalogue()[name]
    assert effect.name == name
    assert isinstance(effect.stage, Stage)
    assert effect.__doc__
    names = [p.name for p in effect.parameters]
    assert len(set(names)) == len(names)
    for p in effect.parameters:
        assert p.low <= p.neutral <= p.high
        assert p.low <= p.typical <= p.high
        assert p.unit
        assert p.source


def test_parameters_not_given_are_typical() -> None:
    assert CableDrag("q1", drag=0.3).values == {"stiffness": 0.1, "drag": 0.3}


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
        ({"stage": Stage.FRICTION, "parameters": ()}, "test_catalogue.Own lacks name$"),
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
