import os
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import find_policy
from tactile_cube.evaluation.policy_path import SHIPPED, networks_path, policy_path


def test_a_run_folder_means_its_latest_policy(tmp_path: Path) -> None:
    (tmp_path / "policy.safetensors").touch()
    assert policy_path(str(tmp_path)) == tmp_path / "policy.safetensors"


def test_a_training_in_stages_means_the_latest_of_its_stages_until_it_has_a_policy_of_its_own(tmp_path: Path) -> None:
    for age, stage in enumerate(("worlds", "holding", "gaiting")):
        (tmp_path / stage).mkdir()
        (tmp_path / stage / "policy.safetensors").touch()
        os.utime(tmp_path / stage / "policy.safetensors", (1000 - age, 1000 - age))
    with pytest.raises(InputError, match="first checkpoint"):  # a folder of runs is no run
        policy_path(str(tmp_path))
    (tmp_path / ".hydra").mkdir()
    assert policy_path(str(tmp_path)) == tmp_path / "worlds" / "policy.safetensors"
    (tmp_path / "policy.safetensors").touch()
    assert policy_path(str(tmp_path)) == tmp_path / "policy.safetensors"


def test_an_unknown_policy_is_refused_with_the_choices() -> None:
    with pytest.raises(InputError, match=r"policy=defalt.*hold, random, scripted.*did you mean policy=default\?$"):
        policy_path("defalt")


def test_the_shipped_policy_is_named_without_the_place_of_the_package() -> None:
    assert find_policy(None).provenance["file"] == "default.safetensors"


def test_training_begins_from_a_shipped_policy_by_its_name() -> None:
    assert networks_path("default") == str(SHIPPED / "default.safetensors")
    assert networks_path(None) is None


def test_training_begins_from_a_run_with_its_critics_where_it_has_a_checkpoint(tmp_path: Path) -> None:
    (tmp_path / "policy.safetensors").touch()
    assert networks_path(str(tmp_path)) == str(tmp_path / "policy.safetensors")
    (tmp_path / "checkpoint.pt").touch()
    assert networks_path(str(tmp_path)) == str(tmp_path / "checkpoint.pt")


def test_a_gait_that_was_searched_acts(tmp_path: Path) -> None:
    file = tmp_path / "gait.yaml"
    file.write_text("best: {swing: 0.5, period: 40, phases: [0.0, 0.1, 0.2, 0.3]}")
    source = find_policy(f"scripted:{file}")
    assert source.label == "scripted gait of gait.yaml"
    assert source.policy._gait.swing == 0.5  # type: ignore[attr-defined]
    assert source.policy._gait.phases == (0.0, 0.1, 0.2, 0.3)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "content", ["", "best: 3", "best: {}", "best: {stride: 1, phases: [0, 0, 0, 0]}", "{", "worst: {}"]
)
def test_a_file_without_a_gait_is_refused(content: str, tmp_path: Path) -> None:
    (tmp_path / "gait.yaml").write_text(content)
    with pytest.raises(InputError, match=r"gait\.yaml"):
        find_policy(f"scripted:{tmp_path / 'gait.yaml'}")
    with pytest.raises(InputError, match=r"nothing\.yaml"):
        find_policy(f"scripted:{tmp_path / 'nothing.yaml'}")
