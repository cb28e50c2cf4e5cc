"""Mistyped keys and options are answered with the nearest that there is."""

import pytest
from hydra.errors import HydraException
from omegaconf import OmegaConf

from tactile_cube.composition import composed, refuse_unknown_keys
from tactile_cube.errors import InputError
from tactile_cube.training.settings import TrainingSettings
from tactile_cube.usage_error import usage_error


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("agent.gama=1", "agent.gamma"),
        ("gamma=1", "agent.gamma"),
        ("trainig.steps=1", "training"),
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
