"""Policies on disk."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, load_actor, read_policy, require_sizes, save_policy, sealed
from tactile_cube.deployment.controller import read_network
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
    loaded, info = load_actor(tmp_path / "p.safetensors")
    x = torch.randn(5, 10)
    assert torch.equal(actor.deterministic(x), loaded.deterministic(x))
    assert (info.seed, info.steps, info.time_constant, info.hidden) == (4, 1000, 0.25, (16, 8))
    assert info.config["env"]["stack"] == 5


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.safetensors: no such file; train a policy"):
        load_actor(tmp_path / "nowhere.safetensors")


@pytest.mark.parametrize("keep", [0, 7, 300])
def test_damaged_file_is_refused(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "p.safetensors"
    saved(path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match="damaged"):
        load_actor(path)


@pytest.mark.parametrize("mask", [0x01, 0x80, 0xFF])
def test_a_changed_byte_anywhere_is_refused_in_one_line(tmp_path: Path, mask: int) -> None:
    path = tmp_path / "p.safetensors"
    saved(path)
    content = path.read_bytes()
    load_actor(path)
    for place in np.linspace(0, len(content) - 1, 64).round().astype(int):
        damaged = bytearray(content)
        damaged[place] ^= mask
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"^[^\n]*p\.safetensors: (damaged|not a policy file)[^\n]*$"):
            load_actor(path)


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.safetensors")), ids=lambda path: path.stem)
def test_shipped_policies_answer_differently_to_different_observations(path: Path) -> None:
    actor, info = load_actor(path)
    rest, bent = actor.deterministic(
        torch.stack([torch.zeros(info.observation_size), torch.full((info.observation_size,), 0.3)])
    )
    assert rest.shape == (info.action_size,)
    assert (rest - bent).abs().max() > 0.1


def strange(header: int = 0, **info: object) -> bytes:
    """A file under a checksum that fits, with something strange about it."""
    tensors = {"actor.0.weight": np.zeros((6, 10), np.float32), "actor.0.bias": np.zeros(6, np.float32)}
    tensors |= info.pop("tensors", {})  # type: ignore[arg-type]
    known = {"observation_size": 10, "action_size": 3, "hidden": []}
    content = sealed(tensors, json.dumps(known | info))
    return header.to_bytes(8, "little") + content[8:] if header else content


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (strange(observation_size=11), r"actor.0.weight has shape \(6, 10\), expected \(6, 11\)"),
        (strange(hidden=[10**9, 10**9]), "key 'hidden.0': Input should be less than or equal to 65536, received 1000"),
        (strange(hidden=[1] * 10**5), "key 'hidden': Tuple should have at most 32 items"),
        (strange(hidden=[5]), "actor.1.bias is missing"),
        (strange(tensors={"extra": np.zeros(1, np.float32)}), "extra is missing or too much"),
        (strange(tensors={"actor.0.bias": np.full(6, np.nan, np.float32)}), "actor.0.bias .* not finite"),
        (strange(tensors={"actor.0.bias": np.zeros(6)}), "actor.0.bias holds float64, expected float32"),
        (strange(time_constant=float("nan")), "key 'time_constant'"),
        (strange(time_constant=0.0), "key 'time_constant'"),
        (strange(commit="a\x1b[2Jb"), "key 'commit'"),
        (strange(header=1 << 60), "a header of 1152921504606846976 bytes"),
        (strange().replace(b"policy 2", b"policy 1"), "not a policy file"),
        (pickle.dumps({"weights": [1.0]}), "damaged or not a policy file"),
        (b"\x02\0\0\0\0\0\0\0{}", "damaged or not a policy file"),
    ],
)
def test_a_file_that_claims_what_it_is_not_is_refused_by_every_reader(tmp_path, content, reason) -> None:
    path = tmp_path / "p.safetensors"
    path.write_bytes(strange())
    read_policy(path)
    path.write_bytes(content)
    for reader in (read_policy, load_actor, read_network):
        with pytest.raises(InputError, match=rf"^[^\n]*p\.safetensors: [^\n]*{reason}[^\n]*$"):
            reader(path)


def test_a_file_larger_than_any_policy_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "p.safetensors").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(InputError, match=r"up to 268\.435 MB are read"):
        load_actor(tmp_path / "p.safetensors")


def test_policy_of_another_environment_is_refused(tmp_path: Path) -> None:
    saved(tmp_path / "p.safetensors")
    _, info = load_actor(tmp_path / "p.safetensors")
    with pytest.raises(InputError, match="10 observations to 3 actions, the environment has 120 and 12"):
        require_sizes(tmp_path / "p.safetensors", info, 120, 12)
