from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.effects.effect import FINGER
from tactile_cube.errors import InputError
from tactile_cube.identification import identification
from tactile_cube.identification.identification import _wanted, identify_effects, with_effect
from tests.identification.rigs_of_any_size import Size, simulated


def test_the_parameters_to_fit_are_named_as_a_diagnosis_names_them(tmp_path: Path) -> None:
    hidden = {"damping": 0.05, "difference": 0.03}
    recording = simulated(tmp_path, Size(), find_effect("viscous_friction"), hidden)
    (named,) = _wanted("viscous_friction(damping, difference)@a", ("a",))
    assert named == (find_effect("viscous_friction"), "a", ("damping", "difference"))
    (term,) = identify_effects(recording, ["viscous_friction@a(difference)"], say=lambda line: None).fitted.model.terms
    assert term.values == pytest.approx(hidden, rel=0.1)  # K_D takes some
    with pytest.raises(InputError, match=r"'viscous_friction@a\(diference\)': 'diference' is none .*difference"):
        identify_effects(recording, ["viscous_friction@a(diference)"])


@pytest.mark.parametrize(("less", "sign"), [(3.0, 1.0), (5.0, -1.0)])
def test_of_starts_that_noise_cannot_tell_apart_the_usual_one_is_taken(less, sign, monkeypatch) -> None:
    monkeypatch.setattr(identification, "residual_candidates", lambda *_: [])
    monkeypatch.setattr(
        identification,
        "stepped",
        lambda _, __, one, ___: (one, SimpleNamespace(cost=1000.0 - less * (one.form["mass"] < 0.0), form=one.form)),
    )
    search = SimpleNamespace(
        shooting=SimpleNamespace(sizes={"a": FINGER}),
        problem=SimpleNamespace(weight=np.ones(1000)),
        fitted=None,
    )
    taken: Any = with_effect(search, None, find_effect("payload"), "a")  # type: ignore[arg-type]
    assert np.sign(taken.form["mass"]) == sign
