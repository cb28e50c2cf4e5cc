"""Policies on disk."""

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from tactile_cube.agent.batch import Sizes
from tactile_cube.agent.networks import Actor
from tactile_cube.agent.policy_file import WITHOUT_CHECKSUM, PolicyInfo, load_policy, require_sizes, save_policy
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policy_path import SHIPPED


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


@pytest.mark.parametrize("mask", [0x01, 0x80, 0xFF])
def test_a_changed_byte_anywhere_is_refused_in_one_line(tmp_path: Path, mask: int) -> None:
    path = tmp_path / "p.safetensors"
    saved(path)
    content = path.read_bytes()
    load_policy(path)
    for place in np.linspace(0, len(content) - 1, 64).round().astype(int):
        damaged = bytearray(content)
        damaged[place] ^= mask
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"^[^\n]*p\.safetensors: (damaged|not a policy file)[^\n]*$"):
            load_policy(path)


def test_a_file_from_before_checksums_is_read_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    actor = saved(tmp_path / "new.safetensors")
    with safe_open(tmp_path / "new.safetensors", "pt") as file:
        tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
        metadata = {"format": WITHOUT_CHECKSUM, "info": file.metadata()["info"]}
    save_file(tensors, tmp_path / "old.safetensors", metadata)
    load_policy(tmp_path / "new.safetensors")
    assert capsys.readouterr().err == ""
    loaded, _ = load_policy(tmp_path / "old.safetensors")
    assert "old.safetensors: from before there were checksums" in capsys.readouterr().err
    assert all(torch.equal(a, b) for a, b in zip(actor.parameters(), loaded.parameters(), strict=True))


def test_shipped_policies_carry_a_checksum(capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted(SHIPPED.glob("*.safetensors"))
    assert files
    for path in files:
        load_policy(path)
    assert capsys.readouterr().err == ""


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
