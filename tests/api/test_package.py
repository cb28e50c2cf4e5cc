"""What `import tactile_cube` gives, and what it costs."""

import importlib
import inspect
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

import tactile_cube
from tactile_cube.composition import commands


@pytest.mark.parametrize(
    ("names", "slow"),
    [
        ("tactile_cube", {"torch", "torchrl", "hydra", "omegaconf", "pybullet", "numba"}),
        (
            "tactile_cube.api.diagnosis, tactile_cube.visualization.diagnosis_report,"
            " tactile_cube.visualization.comparison_episode",
            {"torch", "torchrl", "tensordict", "mujoco"},
        ),
    ],
    ids=["the package", "a diagnosis and its report"],
)
def test_importing_imports_nothing_slow(names: str, slow: set[str]) -> None:
    code = f"import sys, {names}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not set(loaded) & slow


@pytest.mark.parametrize("name", tactile_cube.__all__)
def test_every_name_resolves_is_annotated_and_documented(name: str) -> None:
    thing = getattr(tactile_cube, name)
    assert inspect.getdoc(thing)
    if inspect.isfunction(thing):
        signature = inspect.signature(thing)
        assert signature.return_annotation is not inspect.Signature.empty
        assert all(one.annotation is not inspect.Parameter.empty for one in signature.parameters.values())


@pytest.mark.parametrize("name", commands())
def test_a_commands_module_does_not_hide_its_function(name: str) -> None:
    importlib.import_module(f"tactile_cube.{name}")
    assert name not in tactile_cube.__all__ or callable(getattr(tactile_cube, name))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'tranin'"):
        _ = tactile_cube.tranin  # type: ignore[attr-defined]


def test_type_checkers_are_told_that_the_package_is_annotated() -> None:
    assert resources.files("tactile_cube").joinpath("py.typed").is_file()


def package(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tactile_cube", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def test_commands_are_words_of_the_package_too(tmp_path: Path) -> None:
    listed = package("--help", folder=tmp_path)
    assert listed.returncode == 0
    assert all(f"  {name} " in listed.stdout for name in commands())
    asked = package("compare", "recording=here", "--cfg", "job", folder=tmp_path)
    assert asked.returncode == 0, asked.stderr
    assert "recording: here" in asked.stdout


def test_a_word_that_is_no_command_ends_with_the_commands_there_are(tmp_path: Path) -> None:
    run = package("evalute", folder=tmp_path)
    assert run.returncode == 2
    assert run.stderr.startswith("error: evalute: no such command; choose one of average, compare, deploy")
    assert run.stderr.endswith("; did you mean evaluate?\n")
    assert run.stderr.count("\n") == 1
