"""The mean of a run's weights."""

from pathlib import Path

import pytest
import torch

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, averaged, kept_policies, load_actor, save_policy
from tactile_cube.errors import InputError


def keep(run: Path, steps: int, bias: float, hidden: tuple[int, ...] = (4,)) -> Path:
    actor = Actor(Sizes(3, 0, 2), hidden)
    with torch.no_grad():
        for parameter in actor.parameters():
            parameter.fill_(bias)
    path = run / f"policy_{steps}.safetensors"
    save_policy(path, actor, PolicyInfo.describe(actor, steps=steps, performance=bias))
    return path


def test_the_last_kept_policies_are_those_of_the_most_steps(tmp_path: Path) -> None:
    kept = {steps: keep(tmp_path, steps, 0.0) for steps in (100000, 25000, 50000)}
    (tmp_path / "policy_best.safetensors").write_bytes(b"")
    assert kept_policies(tmp_path, 2) == [kept[50000], kept[100000]]


@pytest.mark.parametrize("last", [0, 3])
def test_more_than_there_are_is_refused(tmp_path: Path, last: int) -> None:
    keep(tmp_path, 1, 0.0), keep(tmp_path, 2, 0.0)
    with pytest.raises(InputError, match=f"last={last}: .* has 2 kept policies"):
        kept_policies(tmp_path, last)


def test_weights_are_the_mean_and_the_file_says_of_what(tmp_path: Path) -> None:
    actor, info = averaged([keep(tmp_path, steps, bias) for steps, bias in ((10, 1.0), (20, 2.0), (30, 6.0))])
    assert all(torch.equal(parameter, torch.full_like(parameter, 3.0)) for parameter in actor.parameters())
    save_policy(tmp_path / "mean.safetensors", actor, info)
    read = load_actor(tmp_path / "mean.safetensors")[1]
    assert (read.averaged, read.steps, read.performance) == ((10, 20, 30), 30, None)


def test_policies_of_other_sizes_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"policy_1\.safetensors: its layers have other sizes"):
        averaged([keep(tmp_path, 1, 0.0, (8,)), keep(tmp_path, 2, 0.0)])
