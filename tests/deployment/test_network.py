from pathlib import Path

import numpy as np
import pytest
import torch

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, save_policy
from tactile_cube.deployment.network import read_network


@pytest.fixture
def policy(tmp_path: Path) -> tuple[Path, Actor]:
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 0, 12), (512, 512))
    save_policy(tmp_path / "policy.safetensors", actor, PolicyInfo.describe(actor, time_constant=0.5))
    return tmp_path / "policy.safetensors", actor


def test_numpy_and_torch_give_the_same_action(policy: tuple[Path, Actor]) -> None:
    path, actor = policy
    observation = np.random.default_rng(1).normal(0.0, 0.5, (50, 120)).astype(np.float32)
    with torch.no_grad():
        expected = actor.deterministic(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(read_network(path)(observation), expected, atol=2e-6)


def test_metadata_comes_along(policy: tuple[Path, Actor]) -> None:
    network = read_network(policy[0])
    assert (network.observation_size, network.action_size) == (120, 12)
    assert network.info["time_constant"] == 0.5
