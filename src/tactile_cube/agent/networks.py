"""Actor and critic of the paper: two hidden layers of 512, the actor without any privileged input."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn

LOG_SCALE_LOW, LOG_SCALE_HIGH = -5.0, 2.0
"""Bounds of log sigma; an untrained actor starts in the middle with sigma = 0.22."""


@dataclass(frozen=True)
class Sizes:
    """Widths of the signals: observation (actor), privileged (critics only), action."""

    observation: int
    privileged: int
    action: int

    @property
    def critic(self) -> int:
        """Width of a critic's input: observation, privileged state and action side by side."""
        return self.observation + self.privileged + self.action


def perceptron(sizes: Sequence[int], layer_norm: bool = False) -> nn.Sequential:
    """Build linear layers with ReLU between them, e.g. sizes (120, 512, 512, 24)."""
    layers: list[nn.Module] = []
    for fan_in, fan_out in itertools.pairwise(sizes[:-1]):
        layers.append(nn.Linear(fan_in, fan_out))
        if layer_norm:
            layers.append(nn.LayerNorm(fan_out, elementwise_affine=False))  # the next layer scales and shifts
        layers.append(nn.ReLU())
    return nn.Sequential(*layers, nn.Linear(sizes[-2], sizes[-1]))


def log_scale(raw: Tensor) -> Tensor:
    """Squash the network's second half to log sigma in [LOG_SCALE_LOW, LOG_SCALE_HIGH]."""
    return LOG_SCALE_LOW + 0.5 * (LOG_SCALE_HIGH - LOG_SCALE_LOW) * (torch.tanh(raw) + 1.0)


def squashed_log_prob(noise: Tensor, log_sigma: Tensor, pre_tanh: Tensor) -> Tensor:
    """Log density of a = tanh(mu + sigma * noise) under the tanh-normal policy, summed over joints, (batch, 1)."""
    normal = -0.5 * noise.square() - log_sigma - 0.5 * math.log(2.0 * math.pi)
    jacobian = 2.0 * (math.log(2.0) - pre_tanh - nn.functional.softplus(-2.0 * pre_tanh))
    return (normal - jacobian).sum(-1, keepdim=True)


class Draw(NamedTuple):
    """Actions drawn from a policy (batch, action), their log density (batch, 1), and the likeliest ones."""

    action: Tensor
    log_prob: Tensor
    likeliest: Tensor


class Actor(nn.Module):
    """Gaussian policy squashed by tanh to actions in [-1, 1]; it sees the stacked observation and nothing else."""

    def __init__(self, sizes: Sizes, hidden: Sequence[int]):
        super().__init__()
        self.body = perceptron((sizes.observation, *hidden, 2 * sizes.action))

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return the mean and scale of the Gaussian before tanh, each (batch, action)."""
        mean, log_sigma = self._gaussian(observation)
        return mean, log_sigma.exp()

    def _gaussian(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        mean, raw = self.body(observation).float().chunk(2, -1)
        return mean, log_scale(raw)

    def sample(self, observation: Tensor) -> Draw:
        """Sample actions with exploration; the noise is drawn from torch's global generator."""
        mean, log_sigma = self._gaussian(observation)
        noise = torch.randn_like(mean)
        pre_tanh = mean + log_sigma.exp() * noise
        return Draw(torch.tanh(pre_tanh), squashed_log_prob(noise, log_sigma, pre_tanh), torch.tanh(mean))

    def layers(self) -> list[nn.Linear]:
        """Return the linear layers, the first one first."""
        return [layer for layer in self.body if isinstance(layer, nn.Linear)]

    def deterministic(self, observation: Tensor) -> Tensor:
        """Return the actions without exploration: tanh of the mean, (batch, action)."""
        mean: Tensor = self.forward(observation)[0]
        return torch.tanh(mean)


class Critic(nn.Module):
    """Q(observation, privileged, action) -> (batch, outputs)."""

    def __init__(self, sizes: Sizes, hidden: Sequence[int], layer_norm: bool = False, outputs: int = 1):
        super().__init__()
        self.body = perceptron((sizes.critic, *hidden, outputs), layer_norm)

    def forward(self, observation: Tensor, privileged: Tensor, action: Tensor) -> Tensor:
        """Return the state-action value (batch, outputs); several outputs are its quantiles."""
        value: Tensor = self.body(torch.cat((observation, privileged, action), -1))
        return value


def lowest(critics: Iterable[nn.Module], observation: Tensor, privileged: Tensor, action: Tensor) -> Tensor:
    """Return the lowest of the critics' values (batch, 1)."""
    return torch.stack([critic(observation, privileged, action).float() for critic in critics]).amin(0)


def build_networks(
    sizes: Sizes, hidden: Sequence[int], layer_norm: bool, critics: int = 2, outputs: int = 1
) -> tuple[Actor, list[Critic]]:
    """Return the actor and critics with torch's default initialisation, drawn in this order from torch's generator."""
    return Actor(sizes, hidden), [Critic(sizes, hidden, layer_norm, outputs) for _ in range(critics)]
