from collections.abc import Callable

import pytest
import torch
from torchrl.envs import TransformedEnv

from tactile_cube.transforms import SensorNoise

MakeEnv = Callable[..., TransformedEnv]


def test_noise_has_the_given_size_and_opposite_signs(transformed: MakeEnv) -> None:
    def readings(std: float) -> tuple[torch.Tensor, torch.Tensor]:
        env = transformed(SensorNoise(std), worlds=200)
        data = env.reset()
        return data["joint_position"], data["control_error"]

    clean, noisy = readings(0.0), readings(0.02)
    noise = noisy[0] - clean[0]
    assert float(noise.std()) == pytest.approx(0.02, rel=0.05)
    assert torch.allclose(noisy[1] - clean[1], -noise, atol=1e-6)


def test_seed_determines_the_noise(transformed: MakeEnv) -> None:
    env = transformed(SensorNoise(0.02))
    runs = []
    for seed in (1, 1, 2):
        env.set_seed(seed)
        runs.append(env.reset()["joint_position"])
    assert torch.equal(runs[0], runs[1])
    assert not torch.equal(runs[0], runs[2])
