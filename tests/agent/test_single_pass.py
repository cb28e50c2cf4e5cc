"""The optimiser's single pass against torch's operations one after the other."""

import numpy as np
import torch

from tactile_cube.agent.settings import AgentSettings
from tactile_cube.agent.single_pass import SinglePass, follow

SETTINGS = AgentSettings(learning_rate=1e-2, weight_decay=0.1, tau=0.05)
SIZE, CRITICS = 1003, 600


def vectors(seed: int) -> tuple[torch.Tensor, ...]:
    """Parameters, working copy, gradient, targets and their working copy."""
    generator = torch.Generator().manual_seed(seed)
    parameters = torch.randn(SIZE, generator=generator)
    targets = torch.randn(CRITICS, generator=generator)
    return parameters, parameters.bfloat16(), torch.zeros(SIZE).bfloat16(), targets, targets.bfloat16()


def adamw(parameters: torch.Tensor) -> torch.optim.AdamW:
    return torch.optim.AdamW([parameters], lr=SETTINGS.learning_rate, weight_decay=SETTINGS.weight_decay)


def gradients(steps: int) -> torch.Tensor:
    return torch.randn(steps, SIZE, generator=torch.Generator().manual_seed(9)).bfloat16()


def test_it_follows_torchs_adamw_and_the_soft_target_update() -> None:
    expected, _, _, expected_targets, _ = vectors(1)
    torchs = adamw(expected)
    parameters, working, gradient, targets, target_working = vectors(1)
    mine = SinglePass(adamw(parameters), parameters, working, gradient, targets, target_working, SETTINGS.tau)
    for slope in gradients(20):
        gradient.copy_(slope)
        mine.step()
        expected.grad = slope.float()
        torchs.step()
        expected_targets.lerp_(expected[-CRITICS:], SETTINGS.tau)
    torch.testing.assert_close(parameters, expected, rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(targets, expected_targets, rtol=1e-5, atol=1e-6)
    assert torch.equal(working, parameters.bfloat16())
    assert torch.equal(target_working, targets.bfloat16())


def test_its_moments_are_in_the_optimizers_state_dict() -> None:
    parameters, working, gradient, targets, target_working = vectors(1)
    optimizer = adamw(parameters)
    mine = SinglePass(optimizer, parameters, working, gradient, targets, target_working, SETTINGS.tau)
    gradient.fill_(0.5)
    mine.step()
    saved = optimizer.state_dict()["state"][0]
    assert float(saved["step"]) == 1.0
    torch.testing.assert_close(saved["exp_avg"], torch.full((SIZE,), 0.05))


def test_rounding_to_bfloat16_takes_ties_to_even() -> None:
    ties = torch.tensor([1.00390625, 1.01171875, -1.00390625, 3.0e38, 1e-40, 0.0])
    targets, working = ties.clone(), torch.zeros(len(ties)).bfloat16()
    follow(ties.numpy(), targets.numpy(), working.view(torch.int16).numpy().view(np.uint16), np.float32(0.0))
    assert torch.equal(working, ties.bfloat16())
