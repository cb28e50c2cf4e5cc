"""Policies on disk."""

from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from tactile_cube.agent.batch import Sizes
from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import PolicyInfo, load_policy, require_sizes, save_policy
from tactile_cube.errors import InputError


def saved(path: Path) -> Actor:
    actor = Actor(Sizes(10, 0, 3), (16, 8))
    save_policy(
        path, actor, PolicyInfo.describe(actor, seed=4, steps=1000, time_constant=0.25, config={"env": {"stack": 5}})
    )
    return actor


def test_policy_comes_back_as_it_was(tmp_path: Path) -> None:
    actor = saved(tmp_path / "p.safetensors")
    loaded, info = load_policy(tmp_path / "p.safetensors")
    x = torch.randn(5, 10)
    assert torch.equal(actor.deterministic(x), loaded.deterministic(x))
    assert (info.seed, info.steps, info.time_constant, info.hidden) == (4, 1000, 0.25, (16, 8))
    assert info.config["env"]["stack"] == 5


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.safetensors: no such policy file"):
        load_policy(tmp_path / "nowhere.safetensors")


@pytest.mark.parametrize("keep", [0, 7, 300])
def test_damaged_file_is_refused(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "p.safetensors"
    saved(path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match="damaged"):
        load_policy(path)


def test_other_safetensors_file_is_refused(tmp_path: Path) -> None:
    save_file({"w": torch.zeros(3)}, tmp_path / "x.safetensors")
    with pytest.raises(InputError, match="not a policy file"):
        load_policy(tmp_path / "x.safetensors")


def test_tensors_that_contradict_the_metadata_are_refused(tmp_path: Path) -> None:
    actor = Actor(Sizes(10, 0, 3), (16, 8))
    info = PolicyInfo.describe(actor).model_copy(update={"observation_size": 11})
    save_policy(tmp_path / "p.safetensors", actor, info)
    with pytest.raises(InputError, match=r"actor.0.weight has shape \(16, 10\), expected \(16, 11\)"):
        load_policy(tmp_path / "p.safetensors")


def test_not_finite_weights_are_refused(tmp_path: Path) -> None:
    actor = Actor(Sizes(10, 0, 3), (16, 8))
    with torch.no_grad():
        actor.body[0].bias[0] = torch.nan
    save_policy(tmp_path / "p.safetensors", actor, PolicyInfo.describe(actor))
    with pytest.raises(InputError, match="not finite"):
        load_policy(tmp_path / "p.safetensors")


def test_policy_of_another_environment_is_refused(tmp_path: Path) -> None:
    saved(tmp_path / "p.safetensors")
    _, info = load_policy(tmp_path / "p.safetensors")
    with pytest.raises(InputError, match="10 observations to 3 actions, the environment has 120 and 12"):
        require_sizes(tmp_path / "p.safetensors", info, 120, 12)
