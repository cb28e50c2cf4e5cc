from pathlib import Path

import numpy as np
import pytest
from omegaconf import OmegaConf

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile, as_model, read_model, write_model
from tactile_cube.errors import InputError


def example() -> ModelFile:
    return ModelFile(
        rig="rig.urdf",
        joints=["q1", "q2"],
        values={"kd": {"q1": Estimate(value=0.24, low=0.23, high=0.25, unit="N m s/rad")}},
        effects=[EffectEstimate(effect="backlash@q2", parameters={"play": Estimate(value=1e-3, low=5e-4, high=2e-3)})],
    )


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    write_model(example(), tmp_path / "model.yaml")
    assert read_model(tmp_path / "model.yaml") == example()


def test_a_bare_number_is_a_value_without_interval(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("joints: [q1]\nvalues: {kp: {q1: 3.5}}\n")
    assert read_model(tmp_path / "m.yaml").values["kp"]["q1"] == Estimate(value=3.5, low=3.5, high=3.5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("joints: [q1]\nvalues: {kp: {q9: 3.0}}", "names joint 'q9'"),
        ("joints: [q1]\nvalues: {kp: {q1: {value: 3, low: 4, high: 5}}}", "does not hold the value"),
        ("joints: [q1]\neffcts: []", "key 'effcts'"),
        ("joints: [q1]\nformat: 7", "key 'format'"),
        ("[1, 2]", "expected a mapping"),
        ("joints: !!python/object/apply:os.system [ls]", "only plain data is read"),
        ("joints: [q1", "not valid YAML"),
        ("joints: &a [*a]", "aliases"),
        ("\n".join(f"k{n}: &k{n} [{', '.join([f'*k{n - 1}' if n else 'x'] * 9)}]" for n in range(9)), "aliases"),
        (f"joints: {'[' * 3000}", "not usable YAML"),
        (f"format: {'9' * 5000}", "larger than any number"),
        ("joints: [q1, q1]", "joints names 'q1' more than once"),
        ("joints: [q1]\njoints: [q2]", "line 2: not valid YAML: the key 'joints' stands twice"),
        (
            "joints: [q1]\neffects: [{effect: backlash@q1}, {effect: backlash@q1}]",
            "effects names 'backlash@q1' more than",
        ),
        ("joints: [q1]\nvalues: {kp: {q1: .inf}}", "values.kp.q1 is inf in [inf, inf]; give finite numbers, 0 or more"),
        ("joints: [q1]\nvalues: {kd: {q1: -1}}", "values.kd.q1 is -1"),
        ("joints: [q1]\nvalues: {kp: {q1: 1e300}}", "key 'values.kp.q1': 1e+300 is beyond 1e+09"),
        ("joints: [q1]\noffsets: {q1: {value: 0, low: -.inf, high: .inf}}", "offsets.q1 is 0 in [-inf, inf]"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_model(tmp_path / "m.yaml")
    assert said in str(caught.value)
    assert "m.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_rigid_drive_is_infinitely_stiff(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("joints: [q1]\nvalues: {stiffness: {q1: .inf}, torque_limit: {q1: 1e5}}")
    values = read_model(tmp_path / "m.yaml").values
    assert (values["stiffness"]["q1"].value, values["torque_limit"]["q1"].value) == (np.inf, 1e5)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_model(tmp_path / "none.yaml")


def test_a_model_is_taken_from_a_configurations_contents() -> None:
    model = ModelFile(joints=["q1"], values={"kp": {"q1": Estimate(value=3.0, low=2.9, high=3.1)}})
    assert as_model(OmegaConf.create({"model": model.model_dump()}).model) == model
    with pytest.raises(InputError, match=r"model: key 'joints'"):
        as_model({"joints": 3})
