import numpy as np

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting.unknowns import Unknown, put_all, read_all
from tactile_cube.identification.search.candidates import Candidate, model_unknowns
from tactile_cube.measurement.replay.model import Model

PLAIN = Model({"kd": np.array([0.2, 0.3])}, (), {0: np.zeros(2), 1: np.zeros(2)})


def test_setting_an_unknown_leaves_the_model_it_came_from_alone() -> None:
    unknown = Unknown("constant", "kd", 1, 0.1, 0.5, 0.05)
    changed = unknown.put(PLAIN, 0.4)
    assert unknown.of(changed) == 0.4
    assert unknown.of(PLAIN) == 0.3


def test_values_stay_within_their_bounds() -> None:
    unknown = Unknown("constant", "kd", 0, 0.1, 0.5, 0.05)
    assert unknown.of(unknown.put(PLAIN, 9.0)) == 0.5


def test_offsets_belong_to_one_initialisation() -> None:
    unknown = Unknown("offset", "offset", 0, -0.1, 0.1, 0.05, initialisation=1)
    changed = unknown.put(PLAIN, 0.02)
    assert changed.offsets[1][0] == 0.02
    assert changed.offsets[0][0] == 0.0


def test_a_candidate_fits_only_the_parameters_of_its_form() -> None:
    backlash = find_effect("backlash")
    model, unknowns = Candidate(backlash, ("q2",), {"gap": 0.01}).added_to(PLAIN)
    assert [u.key for u in unknowns] == ["gap"]
    assert model.terms[0].values == {"play": 0.0, "gap": 0.01, "smooth": 0.0, "softness": 0.01, "crossing": 0.0}
    assert model_unknowns(model) == unknowns
    assert read_all(put_all(model, unknowns, np.array([0.02])), unknowns).tolist() == [0.02]
