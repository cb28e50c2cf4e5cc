"""From arrays and simulated rigs to a comparison, a diagnosis and a model, without a command line."""

import json
from pathlib import Path

import numpy as np
import pytest

import tactile_cube
from tactile_cube import InputError, TrialArrays
from tactile_cube.api.comparison import opened
from tactile_cube.api.job import called_job
from tests.measurement.small_rig import URDF, table, write

RIG = ["source=rig", "source.duration=4", "source.initialisations=2", "source.kinds=[ramps,multisine]"]


def quiet(line: str) -> None:
    """Takes progress."""


def arrays() -> list[TrialArrays]:
    trials = []
    for seed, offset in enumerate((0.0, 0.01)):
        columns = table(seed, offset=offset)
        signals = (
            np.stack([columns[f"{j}.{name}"] for j in "ab"], axis=1) for name in ("command", "position", "torque")
        )
        trials.append(TrialArrays(*signals, kind="sines", initialisation=seed))
    return trials


def test_a_recording_from_arrays_compares_as_the_one_on_disk(tmp_path: Path) -> None:
    nominal = {"stiffness": 25.0, "static_friction": 0.01, "reflected_inertia": 0.003}
    made = tactile_cube.recording_from_arrays(
        arrays(), ["a", "b"], URDF, 100.0, kp=3.0, kd=0.2, torque_limit=1.0, nominal=nominal, read="after",
        resolution=1e-4,
    )  # fmt: skip
    on_disk = tactile_cube.read_recording(write(tmp_path / "r"))
    settings = ["band.simulations=0"]
    errors = [tactile_cube.compare(one, *settings, say=quiet).error for one in (made, on_disk)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-4)
    assert errors[0] > 1e-3


@pytest.mark.parametrize("name", ["2026", "nan"])
def test_a_folder_may_be_called_like_a_number(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert opened(called_job("compare", [f"recording={name}"]).config.recording).joints == ("a", "b")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": np.zeros((300, 3))}, r"trials\[0\]: position has shape \(300, 3\); expected \(samples, 2\)"),
        ({"position": np.zeros((200, 2))}, r"trials\[0\]: position has 200 samples, command has 300"),
        ({"position": np.full((300, 2), 200.0)}, "sines_0"),
    ],
)
def test_arrays_that_cannot_be_used_are_refused(change: dict[str, np.ndarray], message: str) -> None:
    bad = TrialArrays(np.zeros((300, 2)), **change, kind="sines")
    with pytest.raises(InputError, match=message):
        tactile_cube.recording_from_arrays([bad], ["a", "b"], URDF, 100.0, kp=3.0, kd=0.2)


def test_record_compare_diagnose_identify_and_know_it_afterwards(tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(URDF)
    hidden = 'source.hidden=["torque_bias@b: bias=0.05"]'
    measured = tactile_cube.record(tmp_path / "made", *RIG, f"source.urdf={tmp_path}/two.urdf", hidden)
    assert list(measured) == ["", "validation"]
    found = tactile_cube.diagnose(measured[""], "engine=fast", say=quiet)
    assert (found.verdict, found.effects) == ("missing_effect", ["torque_bias@b"])
    fitted = tactile_cube.identify(measured[""], found.effects, "engine=fast", say=quiet)
    bias = fitted.model.effects[0].parameters["bias"]
    assert bias.low <= 0.05 <= bias.high
    assert (
        fitted.errors["with_effects" if "with_effects" in fitted.errors else "+ torque_bias@b"]
        < fitted.errors["nominal"]
    )
    fitted.write(tmp_path / "fitted")
    assert tactile_cube.read_model(tmp_path / "fitted" / "model.yaml") == fitted.model
    before, after = (
        tactile_cube.compare(measured["validation"], "band.simulations=0", model=model, say=quiet)
        for model in (None, fitted.model)
    )
    assert after.error < 0.5 * before.error
    after.write(tmp_path / "compared", rerun=False)
    assert json.loads((tmp_path / "compared" / "comparison.json").read_text())["error"]["overall"] == after.error
