"""Errors of the user in one line, errors of the program as they are."""

import errno
import os
import sys
from collections.abc import Callable
from typing import Any

import pytest
from hydra.errors import HydraException
from hydra.utils import instantiate
from omegaconf import OmegaConf
from omegaconf.errors import MissingMandatoryValue
from torchrl.objectives import REDQLoss, SACLoss, TD3Loss

from tactile_cube import cli
from tactile_cube.agent.networks import Sizes
from tactile_cube.agent.sac import Sac
from tactile_cube.api.environment import env_config
from tactile_cube.composition import composed, help_text, refuse_unknown_keys, suggestion
from tactile_cube.errors import InputError
from tactile_cube.sweep import sweep_folder
from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings
from tactile_cube.usage_error import usage_error


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: CollectorSettings(worlds=0), "collector.worlds=0: Input should be greater than 0"),
        (lambda: CollectorSettings(processes=5), "collector: processes=5 does not divide worlds=12; choose a divisor"),
        (lambda: TrainingSettings(stepz=3), "training.stepz: no such setting"),
        (lambda: RunSettings(name="a", seed=-1), "seed=-1: Input should be greater than or equal to 0"),
        (lambda: Sac(Sizes(3, 2, 1), gamma=2.0), "agent.gamma=2.0: Input should be less than 1"),
        (
            lambda: Sac(Sizes(3, 2, 1), SACLoss, demonstration_weight=2.0),
            "agent.demonstration_weight=2: TorchRL's losses do not imitate; set it to 0",
        ),
        (
            lambda: Sac(Sizes(3, 2, 1), TD3Loss),
            "agent.loss: TD3Loss.__init__() got an unexpected keyword argument 'alpha_init'; give SACLoss, TQCLoss",
        ),
        (lambda: Sac(Sizes(3, 2, 1), REDQLoss), 'agent.loss: \'key "privileged" not found in TensorDict'),
        (
            lambda: instantiate({"_target_": "tactile_cube.env.Task", "name": "full", "filter_time": -1.0}),
            "task.filter_time is -1",
        ),
    ],
)
def test_wrong_values_are_told_by_key_value_and_remedy(make: Callable[[], Any], expected: str) -> None:
    with pytest.raises(Exception) as info:  # noqa: PT011 - the kinds differ, what is told is the claim
        make()
    message = usage_error(info.value)
    assert message is not None
    assert message.startswith(expected)
    assert "\n" not in message


def test_a_command_leaves_the_environment_of_later_programs_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    monkeypatch.setattr(sys, "argv", ["effects", "stribek=1"])
    with pytest.raises(SystemExit, match="2"):
        cli.command_line("effects")()
    assert os.environ["HYDRA_FULL_ERROR"] == "0"


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("effects", ["stribek"], "effect 'stribek' is unknown; did you mean stribeck_friction?"),
        ("diagnose", ["rec"], "rec: settings are KEY=VALUE; did you mean recording=rec?"),
        ("diagnose", ["recordng=rec"], "recordng: no such setting; did you mean recording?"),
        ("record", ["source=csv", "source.controller.ki=5"], "source.controller.ki: no such setting; did you mean"),
        ("record", ["source=csv", "source.xyzzy=5"], "source.xyzzy: no such setting; --help lists them"),
        ("diagnose", ["recording=a", "effects=my.Drag"], "effects=my.Drag: expected a list of names: 'effects=[NAME@"),
        ("identify", ["recording=a", "effects=[1]"], "effects=[1]: expected a list of names"),
        ("identify", ["effects=[backlash(play)@a]"], "no viable alternative at input '[backlash(play)@': quote what"),
        ("diagnose", [], "give either recording=FOLDER (of a recording.yaml) or logs to import: source=csv"),
    ],
)
def test_a_mistyped_command_line_is_told_what_was_meant(name, words, said, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", [name, *words])
    with pytest.raises(SystemExit, match="2"):
        cli.command_line(name)()
    assert capsys.readouterr().err.startswith(f"error: {said}")


def test_input_error_is_found_behind_what_hydra_wraps_around_it() -> None:
    wrapped = RuntimeError("Error in call to target")
    wrapped.__cause__ = InputError("row 3: NaN")
    assert usage_error(wrapped) == "row 3: NaN"


@pytest.mark.parametrize(("key", "said"), [("out", " (folder to write)"), ("nothing", "")])
def test_a_missing_value_is_told_with_its_meaning(key: str, said: str) -> None:
    with pytest.raises(MissingMandatoryValue) as info:
        _ = OmegaConf.create({key: "???"})[key]
    assert usage_error(info.value) == f"{key}=... is missing{said}"


@pytest.mark.parametrize(
    ("word", "near"), [("stribek", "stribeck_friction"), ("coulom", "coulomb_friction"), ("s", "")]
)
def test_the_beginning_of_a_name_tells_it(word: str, near: str) -> None:
    offered = suggestion(
        word, ["viscous_friction", "coulomb_friction", "stribeck_friction"] if word != "s" else ["torque"]
    )
    assert offered == (near and f"; did you mean {near}?")


@pytest.mark.parametrize("choice", ["task=1", "task=[1]"])
def test_a_choice_that_is_no_name_is_told_in_one_line(choice: str) -> None:
    with pytest.raises((TypeError, ValueError)) as info:
        composed("train", [choice])
    message = usage_error(info.value)
    assert message is not None
    assert message.startswith("a choice from a group of conf/ is the name of a file there")


def test_errors_of_the_program_are_not_the_users() -> None:
    assert usage_error(KeyError("x")) is None
    assert usage_error(FileNotFoundError(errno.ENOENT, "gone", "a.csv")) is None


def test_a_full_disk_is_said_with_the_file_and_a_way_out() -> None:
    message = usage_error(OSError(errno.ENOSPC, "No space left on device", "report.html"))
    assert message is not None
    assert message.startswith("report.html: the disk is full")
    assert "hydra.run.dir" in message


def test_a_value_that_another_choice_of_a_group_had_is_named() -> None:
    with pytest.raises(InputError) as info:
        env_config(experiment="alone", exploration="none", start="paper", values={"+start.file": "grasps.npz"})
    assert "StartStates.__init__() got an unexpected keyword argument" in str(info.value)
    assert "full_key: env.start; if it was set for another choice of the group, ~GROUP.KEY" in str(info.value)


@pytest.mark.parametrize("experiment", ["alone", "curriculum"])
def test_any_curriculum_can_be_left_out(experiment: str) -> None:
    ramps = env_config(experiment=experiment, curriculum="none").curriculum
    assert ramps is not None
    assert ramps.by is None


def test_folders_of_a_sweep_neither_begin_with_a_dash_nor_nest_nor_grow_too_long() -> None:
    assert sweep_folder("", 3) == "seed3"
    assert sweep_folder("task=table", 3) == "task=table-seed3"
    assert sweep_folder("training.init_from=a/b.pt", 3) == "training.init_from=a_b.pt-seed3"
    long = [sweep_folder("x" * 300 + end, 0) for end in "ab"]
    assert len(long[0]) < 255
    assert long[0] != long[1]


def test_help_marks_the_default_of_each_group() -> None:
    text = help_text("train")
    assert "*full" in text
    assert "*multi_sync" in text
    assert " seed: 0" in text


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("agent.gama=1", "agent.gamma"),
        ("gamma=1", "agent.gamma"),
        ("trainig.steps=1", "training.steps"),
        ("taks=table", "task"),
        ("task=tabel", "task=table"),
        ("+experiment=curiculum", "experiment=curriculum"),
        ("xyzzy=1", ""),
        ("rerun=false", ""),  # another command's
    ],
)
def test_the_nearest_option_or_key_is_offered(word: str, expected: str) -> None:
    with pytest.raises(HydraException) as info:
        composed("train", [word])
    message = usage_error(info.value)
    assert message is not None
    assert message.partition("; did you mean ")[2] == (expected and f"{expected}?")


def test_a_key_that_settings_or_a_command_do_not_know_gets_one_too() -> None:
    with pytest.raises(ValueError, match="stepz") as info:
        TrainingSettings(stepz=3)
    assert str(usage_error(info.value)) == "training.stepz: no such setting; did you mean training.steps?"
    with pytest.raises(InputError, match=r"^experimnt: no such setting of train; .*; did you mean experiment\?$"):
        refuse_unknown_keys("train", OmegaConf.create({"experimnt": "paper"}))
