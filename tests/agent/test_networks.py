"""What actor and critic see, and the policy's distribution."""

import inspect

import pytest
import torch
from tensordict import TensorDict
from torchrl.modules import TanhNormal

from tactile_cube.agent.networks import Actor, Critic, Sizes, squashed_log_prob
from tactile_cube.agent.sac import stochastic_actor
from tactile_cube.training.collection import Behaviour

SIZES = Sizes(observation=10, privileged=4, action=3)


@pytest.fixture(autouse=True)
def same_numbers_every_time() -> None:
    torch.manual_seed(0)


def test_actor_reads_the_observation_and_nothing_else() -> None:
    assert stochastic_actor(Actor(SIZES, (8,)), 3).in_keys == ["observation"]
    assert Behaviour(Actor(SIZES, (8,))).in_keys == ["observation"]
    assert list(inspect.signature(Actor.forward).parameters) == ["self", "observation"]
    assert next(Actor(SIZES, (8,)).parameters()).shape[1] == SIZES.observation


def test_critic_depends_on_privileged_state() -> None:
    critic = Critic(SIZES, (64,))
    o, a = torch.randn(1, 10), torch.randn(1, 3)
    assert critic(o, torch.zeros(1, 4), a) != critic(o, torch.ones(1, 4), a)


def test_log_prob_is_that_of_torchrl() -> None:
    mean, log_sigma, noise = torch.randn(6, 3), 0.3 * torch.randn(6, 3) - 1, torch.randn(6, 3)
    pre_tanh = mean + log_sigma.exp() * noise
    expected = TanhNormal(mean, log_sigma.exp()).log_prob(torch.tanh(pre_tanh))
    torch.testing.assert_close(
        squashed_log_prob(noise, log_sigma, pre_tanh).squeeze(-1), expected, rtol=1e-3, atol=1e-3
    )


def test_behaviour_draws_uniform_actions_while_random() -> None:
    actor = Actor(SIZES, (8,))
    for parameter in actor.parameters():
        torch.nn.init.zeros_(parameter)  # mean 0, sigma 0.22
    behaviour = Behaviour(actor)
    data = TensorDict({"observation": torch.zeros(4000, 10)}, [4000])
    quiet = behaviour(data.clone())["action"]
    behaviour.random.fill_(1.0)
    wild = behaviour(data.clone())["action"]
    assert abs(wild.std().item() - 1 / 3**0.5) < 0.02
    assert abs(quiet.std().item() - 0.21) < 0.02
