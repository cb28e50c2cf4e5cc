from pathlib import Path

import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.errors import InputError
from tactile_cube.identification.identification import identify_effects
from tests.identification.rigs_of_any_size import Size, simulated


def test_the_parameters_to_fit_are_named_as_a_diagnosis_names_them(tmp_path: Path) -> None:
    hidden = {"damping": 0.05, "difference": 0.03}
    recording = simulated(tmp_path, Size(), find_effect("viscous_friction"), hidden)
    for text in ("viscous_friction(damping, difference)@a", "viscous_friction@a(difference)"):
        (term,) = identify_effects(recording, [text], "fast", say=lambda line: None).fitted.model.terms
        assert term.values == pytest.approx(hidden, rel=0.1)  # K_D takes some

    with pytest.raises(InputError, match=r"'viscous_friction@a\(diference\)': 'diference' is none .*difference"):
        identify_effects(recording, ["viscous_friction@a(diference)"])
