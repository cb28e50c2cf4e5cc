"""What has changed between two models of one machine."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelErrors, ModelFile
from tactile_cube.identification.fitting.resolution import Fitted
from tactile_cube.identification.model_files import changed, drifts, model_file
from tactile_cube.measurement.replay.model import Term, nominal_model
from tests.identification.rigs_of_any_size import Size, simulated


def estimate(value: float, half: float) -> Estimate:
    return Estimate(value=value, low=value - half, high=value + half)


def model(friction: float, play: float = 0.01, half: float = 0.002, offset: float = 0.0) -> ModelFile:
    return ModelFile(
        joints=["a", "b"],
        values={"static_friction": {"a": estimate(friction, half), "b": Estimate(value=0.02, low=0.02, high=0.02)}},
        effects=[EffectEstimate(effect="backlash@b", parameters={"play": estimate(play, half)})],
        offsets={"a": estimate(offset, half)},
    )


def test_numbers_that_both_models_know_with_an_interval_are_compared_the_least_probable_first() -> None:
    found = drifts(model(0.02), model(0.021, play=0.02, offset=1.0))
    assert [one.name for one in found] == ["backlash@b: play", "static_friction@a"]
    assert found[0].difference == pytest.approx(0.01)
    assert found[0].half_width == pytest.approx(0.002 * np.sqrt(2))


def test_a_change_beyond_both_intervals_is_one_and_within_them_is_none() -> None:
    assert not changed(drifts(model(0.02), model(0.022)), 0.01)
    (one,) = changed(drifts(model(0.02), model(0.03)), 0.01)
    assert one.name == "static_friction@a"


def test_a_difference_as_large_as_its_interval_has_a_probability_of_five_per_cent() -> None:
    half = 0.002
    (one, *_) = drifts(model(0.02, half=half), model(0.02 + half * np.sqrt(2), half=half))
    assert one.p_value == pytest.approx(0.05, rel=0.01)


def test_chance_makes_as_many_changes_as_the_significance_allows() -> None:
    rng = np.random.default_rng(0)

    def drawn() -> ModelFile:
        return model(0.02 + 0.002 / 1.96 * rng.normal(), play=0.01 + 0.002 / 1.96 * rng.normal())

    alarms = [bool(changed(drifts(drawn(), drawn()), 0.1)) for _ in range(1000)]
    assert 0.07 < np.mean(alarms) < 0.13


@pytest.mark.parametrize(("slides", "units"), [(True, ("N", "N s/m", "m")), (False, ("N m", "N m s/rad", "rad"))])
def test_numbers_of_a_sliding_joint_are_forces_and_metres(tmp_path: Path, slides: bool, units: tuple[str, ...]) -> None:
    viscous = find_effect("viscous_friction")
    recording = simulated(tmp_path, Size(slides=slides), viscous, {"damping": 0.08})
    term = Term(viscous, "a", viscous("a", damping=0.08).values, ("damping",))
    fitted = replace(nominal_model(recording), terms=(term,))
    errors = ModelErrors(nominal=1.0, refitted=1.0, with_effects=1.0, noise_floor=1.0, over_noise=1.0, joints={})
    fit: Any = SimpleNamespace(unknowns=())
    written = model_file(recording, Fitted(fitted, fit, np.zeros(0), np.zeros(0)), errors, [], "", 0)
    estimates = (written.values["static_friction"], {"a": written.effects[0].parameters["damping"]}, written.offsets)
    assert tuple(one["a"].unit for one in estimates) == units
