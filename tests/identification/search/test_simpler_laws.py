"""The simpler law is named where an interval reaches the value at which the richer one becomes it."""

from dataclasses import replace

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.identification.search.candidates import Candidate
from tactile_cube.identification.search.explanation import Explanation, named_by
from tactile_cube.identification.search.findings import find, simpler_laws
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated

Law = type[Effect]
PAIRS = [
    (law, name, key)
    for law in catalogue().values()
    for name, values in law.contains.items()
    for key in values
    if key != "first"
]
FAMILY = ("coulomb_friction", "presliding_friction", "stribeck_friction", "asymmetric_friction", "friction_drift")


@pytest.fixture(scope="module")
def dry(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A joint with 0.16 N m of dry friction beside what is stated."""
    folder = tmp_path_factory.mktemp("dry")
    return simulated(folder, Size(), find_effect("coulomb_friction"), {"friction": 0.16})


@pytest.fixture(scope="module")
def search(dry: Recording) -> Search:
    effects = tuple(find_effect(name) for name in FAMILY)
    return Search(*held_out_split(dry), np.full(1, NOISE), effects, lambda line: None)


def test_friction_of_constant_size_is_named_and_no_law_that_contains_it(search: Search) -> None:
    verdict = decide(find(search))
    assert named_by(verdict.chosen.effects) == {("coulomb_friction", "a")}
    assert not {name for one in verdict.rivals for name, _ in named_by(one.effects)} & set(FAMILY[1:])


@pytest.mark.parametrize(("law", "name", "key"), PAIRS, ids=lambda one: one if isinstance(one, str) else one.name)
def test_of_every_pair_the_simpler_law_is_tried_where_an_interval_reaches_it(search, law, name, key) -> None:
    """A law at the value at which it becomes another one, and far from there in units of a narrow interval."""
    scales = search.shooting.sizes["a"]
    form = next(form for form in law.forms_at(scales) if key in form)
    own = law.parameters_at(scales)
    edge = min(law.contains[name][key], own[key].high)
    known = {**form, **{k: own[k].typical or 0.2 * own[k].high for k in form if k != key}}
    for value, found in ((edge, True), (own[key].typical or 0.5 * (edge + own[key].high), False)):
        candidate = Candidate(law, ("a",), {**known, key: value}, search.shooting.sizes)
        model, unknowns = candidate.added_to(search.base.fit.model)
        narrow = tuple(replace(u, spread=1e-9 * u.scale) for u in unknowns)
        fit = replace(search.base.fit, model=model, unknowns=(*search.base.fit.unknowns, *narrow))
        one = Explanation((candidate,), fit, search.base.judgement, 0.0, 1.0)
        assert (name in simpler_laws(search, one, 0)) is found
