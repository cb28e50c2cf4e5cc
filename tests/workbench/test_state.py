"""The workbench without a browser: what a notebook does in ten lines."""

import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.errors import InputError
from tactile_cube.identification.identification import identify_effects
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.workbench.background import PHASES
from tactile_cube.workbench.state import Look, Workbench
from tests.workbench.small_bench import HIDDEN, STRIBECK


@pytest.fixture(scope="module")
def opened(measured: Recording) -> Workbench:
    return Workbench(measured)


@pytest.fixture
def bench(opened: Workbench) -> Iterator[Workbench]:
    """As it was opened."""
    yield opened
    while opened.undo():
        pass


@pytest.fixture(scope="module")
def explained(measured: Recording) -> Workbench:
    """With the effect that is hidden in the recording, which a test leaves as it is."""
    bench = Workbench(measured)
    bench.add(STRIBECK)
    return bench


def test_ten_lines_lead_from_a_recording_to_a_model_at_the_noise(bench: Workbench, tmp_path: Path) -> None:
    (best, *_), *_ = bench.candidates("a") or []
    assert best.name == "stribeck_friction"
    assert best.share > 0.5
    assert bench.promised(best) < 0.5 * bench.stage.over_noise
    bench.add(STRIBECK)
    assert [stage.label for stage in bench.stages] == ["stated", "refitted", f"+ {STRIBECK}"]
    stated, refitted, added = bench.stages
    assert stated.errors.overall > refitted.errors.overall > 10 * added.errors.overall
    assert added.over_noise < 1.1
    bench.save(tmp_path / "model")
    saved = read_model(tmp_path / "model" / "model.yaml")
    for name, value in HIDDEN.items():
        estimate = saved.effects[0].parameters[name]
        assert abs(value - estimate.value) < estimate.high - estimate.low, "one draw of noise: 95 % is no promise"
    assert saved.provenance.held_out == bench.never_fitted
    assert (tmp_path / "model" / "report.html").is_file()


def test_what_any_law_could_explain_is_little_once_the_effect_is_there(bench: Workbench, explained: Workbench) -> None:
    assert bench.explainable("a") > 0.8
    assert explained.explainable("a") < 0.2
    names = [one.name for twins in explained.candidates("a") or [] for one in twins]
    assert "stribeck_friction" not in names, "what the model has is offered no more"


def test_the_error_by_stage_is_that_of_identify(explained: Workbench, measured: Recording) -> None:
    stages = identify_effects(measured, [STRIBECK], say=lambda line: None).stages
    mine = {stage.label: stage.errors.overall for stage in explained.stages}
    assert mine["stated"] == stages["nominal"].overall
    assert mine["refitted"] == pytest.approx(stages["refitted"].overall, rel=1e-6)
    assert mine[f"+ {STRIBECK}"] == pytest.approx(stages[f"+ {STRIBECK}"].overall, rel=0.1)  # which fits all windows


def test_nothing_is_fitted_to_the_trials_that_judge(bench: Workbench) -> None:
    assert set(bench.never_fitted).isdisjoint(trial.name for trial in bench.search.fitted.trials)
    assert len(bench.recording.trials) == 4


def test_a_value_is_tried_without_a_change_and_set_with_a_stage_that_undo_takes_back(bench: Workbench) -> None:
    name = bench.never_fitted[0]
    before = bench.simulate(name).position
    damping = next(one.unknown for one in bench.values("a") if one.key == "kd@a")
    tried = bench.simulate(name, damping.put(bench.stage.model, 0.25)).position
    assert np.abs(tried - before).max() > 1e-4
    assert len(bench.history) == 1
    bench.set_parameter("kd@a", 0.24)
    bench.set_parameter("kd@a", 0.25)
    assert [stage.label for stage in bench.stages] == ["stated", "refitted", "by hand"]
    assert np.array_equal(bench.simulate(name).position, tried)
    assert {one.key: one for one in bench.values("a")}["kd@a"].interval is None
    assert bench.undo()
    assert bench.undo()
    assert not bench.undo()
    assert np.array_equal(bench.simulate(name).position, before)
    with pytest.raises(InputError, match=r"kd@b: no number of the model; it has kd@a"):
        bench.set_parameter("kd@b", 1.0)


def test_an_effect_is_taken_out_again(bench: Workbench) -> None:
    refitted = bench.stage.errors.overall
    bench.add(STRIBECK)
    with pytest.raises(InputError, match="the model has it already"):
        bench.add(STRIBECK)
    bench.remove(STRIBECK)
    assert bench.effects == []
    assert bench.stage.errors.overall == pytest.approx(refitted, rel=0.01)
    with pytest.raises(InputError, match=r"backlash@a: the model has only its constants"):
        bench.remove("backlash@a")


@pytest.fixture(scope="module")
def looks(opened: Workbench) -> list[list[Look]]:
    return opened.candidates("a") or []


def test_the_signature_of_the_true_effect_looks_like_what_is_missing(bench: Workbench, looks: list[list[Look]]) -> None:
    missing, (best, *others) = bench.missing("a"), [one for twins in looks for one in twins]

    def alike(look: Look) -> float:
        return float(np.corrcoef(missing.torque, bench.signature(look).torque)[0, 1])

    assert alike(best) > 0.7
    assert alike(best) > max(alike(one) for one in others if one.name == "cogging")


def test_effects_that_these_trials_do_not_tell_apart_stand_together(looks: list[list[Look]]) -> None:
    groups = [{one.name for one in twins} for twins in looks]
    assert {"asymmetric_friction", "coulomb_friction"} <= next(one for one in groups if "coulomb_friction" in one)
    assert {"cogging"} in groups


def test_an_experiment_is_proposed_for_the_effect_that_was_added(bench: Workbench, explained: Workbench) -> None:
    with pytest.raises(InputError, match="add an effect first"):
        bench.propose()
    proposed = explained.propose()
    assert proposed.decides
    assert set(proposed.predictions) == {"refitted", f"+ {STRIBECK}"}


def test_a_saved_model_is_the_next_one_to_begin_with(explained: Workbench, measured: Recording, tmp_path: Path) -> None:
    explained.save(tmp_path)
    again = Workbench(measured, tmp_path / "model.yaml")
    assert again.effects == [STRIBECK]
    assert again.stages[0].errors.overall < 0.1 * explained.stages[0].errors.overall
    assert again.stages[1].over_noise < 1.5


OWN = "my_rig.CableDrag"


def test_an_effect_of_ones_own_is_named_at_the_start_and_added_by_the_same_call(bench, measured, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    import_module("my_rig")
    with pytest.raises(InputError, match=r"name it when the workbench starts, own_effects=\[my_rig\.CableDrag\]"):
        bench.add(f"{OWN}@a")
    own = Workbench(measured, own_effects=[OWN])
    assert own.add(f"{OWN}@a").label == f"+ {OWN}@a"


def test_a_first_look_gives_way_to_whoever_waits(bench: Workbench) -> None:
    asked = []

    def stop() -> bool:
        asked.append(True)
        return len(asked) > 1

    assert bench.candidates("a", stop) is None
    assert len(asked) == 2


def test_a_diagnosis_tells_its_progress_and_the_errors_before_and_after_its_model_is_taken(bench, tmp_path) -> None:
    running = bench.diagnose(tmp_path)
    shares = [running.share for _ in running.lines()]
    assert shares == sorted(shares)
    assert set(PHASES.values()) <= set(shares), "what a diagnosis says is that by which its share is known"
    assert STRIBECK in re.sub(r"\(.*?\)", "", running.best), "in whichever form"
    found = running.found
    assert found is not None
    assert found.effects == [STRIBECK]
    assert (tmp_path / "report.html").is_file()
    answer = json.loads((tmp_path / "diagnosis.json").read_text())
    bench.adopt(found)
    assert [stage.label for stage in bench.stages] == ["stated", "refitted", f"+ {STRIBECK}"]
    stated, refitted, added = bench.stages
    assert {"refitted": refitted.over_noise, "with_effects": added.over_noise} == answer["error_over_noise"]
    assert answer["error"]["nominal"] == stated.errors.overall
    assert answer["error"]["with_effects"] == added.errors.overall
    saved = bench.model_file()
    assert saved.errors is not None
    assert saved.errors.over_noise == found.over_noise
    assert saved.effects == read_model(tmp_path / "model.yaml").effects


def test_a_number_is_fixed_and_another_one_bounded_in_every_refit(measured: Recording) -> None:
    bench = Workbench(measured)
    found = {one.key: one for one in bench.values("a")}
    bench.set_parameter("kd@a", 0.24)
    bench.bound("kd@a", 0.24, 0.24)
    low = found["static_friction@a"].value + 0.003
    bench.bound("static_friction@a", low, found["static_friction@a"].unknown.high)
    bench.add(STRIBECK)
    after = {one.key: one for one in bench.values("a")}
    assert after["kd@a"].value == 0.24
    assert after["kd@a"].fixed
    assert after["kd@a"].interval is None
    assert after["static_friction@a"].value >= low
    bench.bound("kd@a", found["kd@a"].unknown.low, found["kd@a"].unknown.high)
    assert bench.refit().label == "refitted"
    assert {one.key: one for one in bench.values("a")}["kd@a"].value != 0.24
    with pytest.raises(InputError, match=r"kd@a: bounds 2 to 1; give the smaller one first, both within"):
        bench.bound("kd@a", 2.0, 1.0)
