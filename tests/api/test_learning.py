"""Training, trying and exporting a policy without a command line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tactile_cube
from tactile_cube import InputError
from tactile_cube.api.job import called_job

SHORT = {"collector.worlds": 4, "training.learning_starts": 100, "training.random_steps": 100, "training.steps": 200}


def test_train_evaluate_load_and_export(tmp_path: Path) -> None:
    result = tactile_cube.train(experiment="smoke", collector="single", values=SHORT, folder=tmp_path / "run")
    assert result.steps == 200
    assert result.curve()["steps"][-1] == 200
    tried = tactile_cube.evaluate(
        result.folder, protocol="smoke", values={"protocol.seconds": 0.5}, say=lambda line: None
    )
    assert tried.summary.episodes == 2
    assert tried.episode(1).theta[-1] == tried.variants[0].results[1].final_angle
    action = tactile_cube.load_policy(result.policy)(np.zeros((3, 120), dtype=np.float32))
    assert action.shape == (3, 12)
    assert tactile_cube.export(result.policy, tmp_path / "policy.npz").is_file()


def test_a_call_without_a_folder_goes_where_the_command_would() -> None:
    job = called_job("train", {"experiment": "smoke", "seed": 4, "task": None})
    assert str(job.folder) == "outputs/train/smoke-seed4"
    assert job.command == "python -m tactile_cube.train +experiment=smoke seed=4"


def test_an_environment_is_made_of_the_settings_of_train() -> None:
    env = tactile_cube.make_env(tactile_cube.env_config(task="table", values={"env.stack": 3}), worlds=2)
    assert env.rollout(2)["observation"].shape == (2, 2, 72)
    assert tactile_cube.env_config(values={"task.filter_time": 0.25}).task.filter_time == 0.25


def test_wrong_values_are_input_errors_as_on_the_command_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="policy=nobody: no such file"):
        tactile_cube.evaluate("nobody")
    with pytest.raises(InputError, match=r"task\.filter_time is -1"):
        tactile_cube.make_env(tactile_cube.env_config(values={"task.filter_time": -1}))
    with pytest.raises(InputError, match=r"agent\.gama"):
        tactile_cube.train(values={"agent.gama": 1}, folder=tmp_path)


@pytest.mark.parametrize(
    ("call", "due"),
    [
        (lambda: tactile_cube.record("out=x", source="finger"), "out"),
        (lambda: tactile_cube.record("source=finger"), "out"),
        (lambda: tactile_cube.evaluate("randomization=wide"), "policy"),
        (lambda: tactile_cube.evaluate("hold", protocol="smoke", model="model=x"), "model"),
        (lambda: tactile_cube.compare("recording=x"), "recording"),
        (lambda: tactile_cube.view("run=x"), "run"),
    ],
)
def test_a_setting_in_the_place_of_a_value_is_refused_and_makes_no_file_of_that_name(
    call: Callable[[], object], due: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=rf"is a setting where the value of {due} is due"):
        call()
    assert not list(tmp_path.iterdir())


def test_a_folder_whose_name_looks_like_a_setting_is_named_by_a_path(tmp_path: Path) -> None:
    job = called_job("record", {"source": "finger", "out": tmp_path / "out=x"})
    assert job.config.out == str(tmp_path / "out=x")
    assert called_job("record", {"out": Path("out=x")}).config.out == "out=x"
