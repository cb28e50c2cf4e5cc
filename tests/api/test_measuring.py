"""From arrays and simulated rigs to a comparison, a diagnosis and a model, without a command line."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactile_cube
from tactile_cube import InputError, TrialArrays
from tactile_cube.api.comparison import opened
from tactile_cube.api.job import worded_job
from tactile_cube.drivetrain.model_file import ModelFile
from tests.measurement.small_rig import URDF, setting, table, write

RIG = {
    "source.joints": ["b"],
    "source.duration": 3,
    "source.initialisations": 2,
    "source.kinds": ["ramps", "multisine"],
}
"""Of source="rig"."""


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
    settings = {"band.simulations": 0}
    errors = [tactile_cube.compare(one, values=settings, say=quiet).error for one in (made, on_disk)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-4)
    assert errors[0] > 1e-3


@pytest.mark.parametrize("name", ["2026", "nan"])
def test_a_folder_may_be_called_like_a_number(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert opened(worded_job("compare", [f"recording={name}"]).config.recording).joints == ("a", "b")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": np.zeros((300, 3))}, r"trials\[0\]: position has shape \(300, 3\); expected \(samples, 2\)"),
        ({"position": np.zeros((200, 2))}, r"trials\[0\]: position has 200 samples, command has 300"),
        ({"position": np.full((300, 2), 200.0)}, "sines_0"),
    ],
)
def test_arrays_of_the_wrong_shape_are_refused(change: dict[str, np.ndarray], message: str) -> None:
    bad = TrialArrays(np.zeros((300, 2)), **change, kind="sines")
    with pytest.raises(InputError, match=message):
        tactile_cube.recording_from_arrays([bad], ["a", "b"], URDF, 100.0, kp=3.0, kd=0.2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trials": []}, "'trials'"),
        ({"trials": arrays()[0]}, "trials: expected a list of TrialArrays"),
        ({"trials": [(0, 1)]}, "trials: expected a list of TrialArrays"),
        ({"trials": [TrialArrays(None, np.zeros((9, 2)))]}, r"trials\[0\]: command is None"),  # type: ignore[arg-type]
        ({"trials": [TrialArrays([["x"] * 2] * 9, np.zeros((9, 2)))]}, r"trials\[0\]: command holds no numbers"),
        ({"trials": [TrialArrays(np.zeros((9, 2)), np.full((9, 2), np.nan))]}, "position has no finite number"),
        ({"rate": 0.0}, "rate is 0.0; give the samples per second"),
        ({"rate": "500"}, "rate is '500'"),
        ({"kp": "a"}, "'controller.kp"),
        ({"mode": "effort"}, "'controller.mode'"),
        ({"gravity": (0.0, 1.0)}, "'gravity"),
        ({"joints": ["a", "a"]}, "more than once"),
        ({"nominal": {"stifness": 3.0}}, r"'nominal\.stifness': unknown; .*; did you mean stiffness\?"),
    ],
)
def test_what_arrays_lack_is_told_in_one_line(change: dict[str, Any], message: str) -> None:
    given = {"trials": arrays(), "joints": ["a", "b"], "urdf": URDF, "rate": 100.0, "kp": 3.0, "kd": 0.2}
    with pytest.raises(InputError, match=message) as told:
        tactile_cube.recording_from_arrays(**(given | change))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("word", "message"), [("step=0", "step=0: give"), ("step=-1", "step=-1"), ("seed=a", "seed=a: give a whole")]
)
def test_a_step_or_a_seed_that_is_none_is_refused(word: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        worded_job("compare", ["recording=x", word])


def test_a_name_that_stands_twice_and_a_band_of_no_size_are_told_at_once(tmp_path: Path) -> None:
    folder = write(tmp_path)
    with pytest.raises(InputError, match="effects: 'viscous_friction@a' is named twice"):
        tactile_cube.identify(folder, ["viscous_friction", "viscous_friction(difference)@a"], say=quiet)
    with pytest.raises(InputError, match=r"band\.simulations=-3: Input should be greater than or equal to 0"):
        tactile_cube.compare(folder, values={"band.simulations": -3})
    with pytest.raises(InputError, match=r"band\.spread\.kp=x: Input should be a valid number"):
        tactile_cube.compare(folder, values={"band.spread.kp": "x"})


def test_a_model_is_compared_at_another_gain_of_the_firmware(tmp_path: Path) -> None:
    def at(kp: float, gain: float | None = None) -> float:
        model = ModelFile.model_validate({"joints": ["a", "b"], "values": {"kp": {"a": kp, "b": kp}}})
        return tactile_cube.compare(folder, model=model, gain=gain, values={"band.simulations": 0}).error

    folder = write(tmp_path)
    assert at(1.5, 2.0) == at(3.0) != at(1.5)
    with pytest.raises(InputError, match=r"gain=0\.0: give the P gain over that at which"):
        at(3.0, 0.0)
    with pytest.raises(InputError, match=r"gain=2: give model=model\.yaml with a kp"):
        tactile_cube.compare(folder, gain=2)


def test_an_effect_that_cannot_act_at_its_joint_is_told(tmp_path: Path) -> None:
    def one(columns: dict[str, np.ndarray]) -> None:
        for name in [name for name in columns if name.startswith("b.")]:
            del columns[name]

    folder = write(tmp_path, setting({"joints": ["a"]}), one)
    with pytest.raises(InputError, match="'torque_crosstalk@a' cannot act there"):
        tactile_cube.identify(folder, ["torque_crosstalk@a"], say=quiet)


def test_record_identify_and_know_it_afterwards(tmp_path: Path) -> None:
    """The test of the examples' notebook has such an effect named by a diagnosis."""
    (tmp_path / "two.urdf").write_text(URDF)
    rig = RIG | {"source.urdf": tmp_path / "two.urdf", "source.hidden": ["torque_bias@b: bias=0.05"]}
    measured = tactile_cube.record(tmp_path / "made", source="rig", values=rig)
    assert list(measured) == ["", "validation"]
    fitted = tactile_cube.identify(measured[""], ["torque_bias@b"], say=quiet)
    bias = fitted.model.effects[0].parameters["bias"]
    assert bias.low <= 0.05 <= bias.high
    assert (
        fitted.errors["with_effects" if "with_effects" in fitted.errors else "+ torque_bias@b"]
        < fitted.errors["nominal"]
    )
    fitted.write(tmp_path / "fitted")
    assert tactile_cube.read_model(tmp_path / "fitted" / "model.yaml") == fitted.model
    before, after = (
        tactile_cube.compare(measured["validation"], values={"band.simulations": 0}, model=model, say=quiet)
        for model in (None, fitted.model)
    )
    assert after.error < 0.5 * before.error
    after.write(tmp_path / "compared", rerun=False)
    assert json.loads((tmp_path / "compared" / "comparison.json").read_text())["error"]["overall"] == after.error
