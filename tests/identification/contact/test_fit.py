import numpy as np
import pytest

from tactile_cube.identification.contact.fit import (
    NARROWINGS,
    ContactFit,
    GroupEstimate,
    contact_unknowns,
    first_value,
    fit_contact,
    group_estimate,
    narrowed,
    summarise_fit,
)
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import (
    LateralFriction,
    ObjectCom,
    ObjectSize,
    SpinningFriction,
    TipCompliance,
)
from tests.identification.easy_contact import GrippedTrial, LoadedTrial, friction

LATERAL = contact_unknowns([LateralFriction])[0]


def said(initialisation: int, value: float, telling: bool = True) -> GroupEstimate:
    return GroupEstimate("t", initialisation, value, telling, 1.0)


def test_a_grid_spans_the_bounds_in_equal_factors_or_differences() -> None:
    grid = LATERAL.grid()
    assert (grid[0], grid[-1]) == pytest.approx((0.2, 1.6))
    np.testing.assert_allclose(grid[1:] / grid[:-1], grid[1] / grid[0])
    compliance = contact_unknowns([TipCompliance])[0].grid()
    np.testing.assert_allclose(np.diff(compliance), compliance[1])
    assert max(narrowed([friction("hold", 0)], ContactModel({}), LATERAL, 1.6)) == pytest.approx(1.6)  # type: ignore[list-item]


def test_an_effect_has_an_unknown_for_each_parameter() -> None:
    assert [one.label for one in contact_unknowns([ObjectCom, LateralFriction])] == [
        "object_com x",
        "object_com y",
        "object_com z",
        "lateral_friction",
    ]


@pytest.mark.parametrize("truth", [0.3, 0.62, 1.3])
def test_the_coarse_grid_and_narrower_ones_find_the_truth(truth: float) -> None:
    trials = [friction("hold", k, truth) for k in range(2)]
    start = first_value(trials, ContactModel({}), LATERAL)  # type: ignore[arg-type]
    assert start is not None
    found = group_estimate(trials, ContactModel({}), LATERAL, start)  # type: ignore[arg-type]
    assert found.telling
    assert found.value == pytest.approx(truth, rel=0.05)


def test_a_trial_that_does_not_change_knows_nothing() -> None:
    trial = friction("twist", 0)
    assert first_value([trial], ContactModel({}), LATERAL) is None  # type: ignore[list-item]
    assert not group_estimate([trial], ContactModel({}), LATERAL, 0.9).telling  # type: ignore[list-item]


def test_the_interval_is_students_of_the_initialisations() -> None:
    values = [0.5, 0.6, 0.66]
    by_initialisation = [said(k, value) for k, value in enumerate(values)] + [said(3, 0.1, telling=False)]
    logs = np.log(values)
    half = np.hypot(4.3027 * logs.std(ddof=1) / np.sqrt(3), 0.03)
    estimate = summarise_fit(LATERAL, by_initialisation)
    assert np.log([estimate.low, estimate.value, estimate.high]) == pytest.approx(
        [logs.mean() - half, logs.mean(), logs.mean() + half], abs=1e-4
    )


def test_initialisations_that_agree_leave_the_spacing_of_the_last_grid() -> None:
    unknown = contact_unknowns([SpinningFriction])[0]
    estimate = summarise_fit(unknown, [said(k, 0.02) for k in range(3)])
    assert np.log(estimate.high / 0.02) == pytest.approx(unknown.spacing / 2**NARROWINGS)


def test_without_a_telling_trial_the_interval_is_everything() -> None:
    estimate = summarise_fit(LATERAL, [said(0, 0.5, telling=False)])
    assert (estimate.value, estimate.low, estimate.high) == (0.9, 0.2, 1.6)


@pytest.mark.parametrize(
    ("values", "stated", "shown"),
    [
        ([0.005, 0.006, 0.007], 0.0, True),
        ([0.005, 0.006, 0.007], 0.006, False),  # news is what the model does not state
        ([0.005, -0.002, 0.003], 0.0, False),
        ([0.006], 0.0, True),  # within the spacing of the first grid, 5 mm
        ([0.004], 0.0, False),
        ([], 0.0, False),
    ],
)
def test_an_effect_shows_where_the_initialisations_agree(values: list[float], stated: float, shown: bool) -> None:
    by_initialisation = {("object_size", "excess"): [said(k, value) for k, value in enumerate(values)]}
    fit = ContactFit(ContactModel({}), {}, by_initialisation)
    assert fit.shows(ObjectSize, ContactModel({"object_size": {"excess": stated}})) is shown


def test_one_trial_alone_gives_a_wide_interval() -> None:
    estimate = summarise_fit(LATERAL, [said(0, 0.6)])
    assert estimate.low < 0.45 < 0.6 < 0.8 < estimate.high


def test_each_effect_is_fitted_on_the_kind_of_trial_that_shows_it() -> None:
    trials = [friction(kind, k, 0.6, 0.03) for k in range(3) for kind in ("hold", "twist")]
    fit = fit_contact(trials, [LateralFriction, SpinningFriction], ContactModel({}), lambda line: None)  # type: ignore[arg-type]
    assert {one.trials.split("_")[0] for one in fit.by_initialisation["spinning_friction", "radius"]} == {"twist"}
    assert fit.contact.values["lateral_friction"]["coefficient"] == pytest.approx(0.6, rel=0.05)
    assert fit.contact.values["spinning_friction"]["radius"] == pytest.approx(0.03, rel=0.05)
    assert fit.silent() == []


def test_numbers_that_show_only_together_are_found_together() -> None:
    trials = [LoadedTrial("hold", k, {}, {}) for k in range(3)]
    fit = fit_contact(trials, [ObjectCom], ContactModel({}), lambda line: None)  # type: ignore[arg-type]
    found = [fit.contact.values["object_com"][key] for key in "xyz"]
    np.testing.assert_allclose(found, LoadedTrial.truth_xyz, atol=2e-4)
    assert fit.silent() == []


def test_a_trial_without_load_tells_nothing_of_the_centre_of_mass() -> None:
    trials = [friction("hold", k) for k in range(3)]
    fit = fit_contact(trials, [ObjectCom], ContactModel({}), lambda line: None)  # type: ignore[arg-type]
    assert fit.silent() == ["object_com x", "object_com y", "object_com z"]
    assert fit.estimates["object_com", "x"].low == -0.03


def test_a_size_is_the_one_that_needs_the_smallest_offsets() -> None:
    trials = [GrippedTrial("hold", k, {("object_size", "excess"): 0.0035}, {}) for k in range(3)]
    fit = fit_contact(trials, [ObjectSize], ContactModel({}), lambda line: None)  # type: ignore[arg-type]
    assert fit.contact.values["object_size"]["excess"] == pytest.approx(0.0035, abs=4e-4)
