"""A function's keywords are its command's keys and groups, its errors the command line's, its values of any kind."""

import inspect
import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser

import tactile_cube
from tactile_cube.api.job import NO_KEYS, as_word, called_job
from tactile_cube.composition import ADDED, CONFIG, commands
from tactile_cube.errors import InputError

FOLDERS_AND_FILES = {"name", "hydra", "film", "report", "rerun"}
"""Keys that say where the command's files go and which: a program has `folder`, and `write` of what comes back."""
OF_RECIPES = {"stages", "judgement"}


def keys_of(command: str) -> tuple[set[str], set[str]]:
    """Single keys and groups of a command, and those that hold other keys."""
    content = yaml.safe_load((CONFIG / f"{command}.yaml").read_text())
    choices = [key for entry in content.pop("defaults") if isinstance(entry, dict) for key in entry]
    groups = {key for key in choices if (CONFIG / key).is_dir() and key != "hydra"}
    groups |= set(ADDED) if command == "train" else set()
    nested = {key for key, value in content.items() if isinstance(value, dict) and value}
    return groups | content.keys() - nested, nested


@pytest.mark.parametrize("command", sorted(commands().keys() - {"workbench", "effects"}))
def test_the_keywords_of_a_function_are_the_keys_of_its_command(command: str) -> None:
    keys, nested = keys_of(command)
    functions = [command, *(["export_model"] if command == "export" else [])]
    signatures = [inspect.signature(getattr(tactile_cube, name)).parameters for name in functions]
    keywords = {name for parameters in signatures for name in parameters}
    assert keywords - {*NO_KEYS} == keys - FOLDERS_AND_FILES - OF_RECIPES
    assert "values" in keywords or not nested - {"hydra"}


@pytest.mark.parametrize(
    "value",
    [
        None, True, 3, -0.25, 1e-9, math.inf, "plain", "2026", "null", "True", "with space", "it's", 'say "so"', "a,b",
        "back\\slash\\", "x=1", "", "backlash@q2: play=0.05", ["a", 1.5, None, ["b:c"]], {"task": "full", "n": [1]},
    ],
)  # fmt: skip
def test_a_value_arrives_as_it_was_given(value: Any) -> None:
    (override,) = OverridesParser.create().parse_overrides([as_word("key", value)])
    assert override.value() == value


def test_the_command_of_a_call_is_one_that_can_be_typed() -> None:
    given = {"recording": Path("logs of/today"), "values": {"band.simulations": 0}, "step": 0.001, "say": print}
    job = called_job("compare", given)
    typed = "python -m tactile_cube.compare 'recording='\"'\"'logs of/today'\"'\"'' step=0.001 band.simulations=0"
    assert job.command == typed
    assert (job.config.recording, job.config.band.simulations) == ("logs of/today", 0)


def test_a_file_may_have_a_name_that_yaml_would_interpolate() -> None:
    assert called_job("compare", {"recording": "${seed}"}).config.recording == "${seed}"


def test_keys_that_there_are_not_are_told_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"efects: no such setting of diagnose; .*did you mean effects\?"):
        tactile_cube.diagnose("r", efects=["a"])  # type: ignore[call-arg]
    with pytest.raises(InputError, match=r"band\.simulatons"):
        tactile_cube.compare("r", values={"band.simulatons": 3})
    with pytest.raises(InputError, match="'seed=1 ': no key of the configuration"):
        tactile_cube.compare("r", values={"seed=1 ": 3})
