"""The fast composition against TorchRL's SACLoss."""

import io
from typing import Any

import pytest
import torch
from tensordict import TensorDict
from torchrl.objectives import SACLoss

from tactile_cube.agent.flat_perceptron import FlatPerceptron, parameter_count, rectify_gradient_
from tactile_cube.agent.networks import Sizes, perceptron
from tactile_cube.agent.sac import ImitatingLoss, Sac
from tactile_cube.agent.sac_fast import FastSac

SIZES = Sizes(observation=30, privileged=7, action=4)
SETTINGS: dict[str, Any] = {"hidden": (64, 48), "batch_size": 32, "learning_rate": 1e-3}


def random_batch(rows: int = 32, seed: int = 1) -> TensorDict:
    generator = torch.Generator().manual_seed(seed)

    def normal(width: int) -> torch.Tensor:
        return torch.randn(rows, width, generator=generator)

    terminated = normal(1) > 1.0
    following = {
        "observation": normal(SIZES.observation),
        "privileged": normal(SIZES.privileged),
        "reward": normal(1),
        "done": terminated,
        "terminated": terminated,
    }
    batch = {
        "observation": normal(SIZES.observation),
        "privileged": normal(SIZES.privileged),
        "action": torch.tanh(normal(SIZES.action)),
        "steps_to_next_obs": torch.randint(1, 4, (rows, 1), generator=generator).float(),
        "demonstrated": normal(1) > 0.0,
        "next": following,
    }
    return TensorDict(batch, [rows])


def pair(**settings: Any) -> tuple[Sac, FastSac]:
    torch.manual_seed(3)
    plain = Sac(SIZES, **(SETTINGS | settings))
    torch.manual_seed(3)
    return plain, FastSac(SIZES, **(SETTINGS | settings))


def gradients_of_fast(fast: FastSac) -> list[torch.Tensor]:
    """In the order and orientation of the torch modules: actor, critic 1, critic 2."""
    networks = fast.networks
    views = [networks.actor, *networks.critics]
    return [tensor for view in views for weight, bias in view.gradients for tensor in (weight.t(), bias)]


def gradients_of_sac(plain: Sac, batch: TensorDict) -> list[torch.Tensor]:
    losses = plain.losses(batch)
    (losses["loss_qvalue"] + losses["loss_actor"] + losses["loss_alpha"]).backward()
    by_name = {name: p.grad for name, p in plain.loss.named_parameters()}
    actor = [grad for name, grad in by_name.items() if name.startswith("actor")]
    critics = [grad for name, grad in by_name.items() if name.startswith("qvalue")]
    return [*actor, *(grad[0] for grad in critics), *(grad[1] for grad in critics)]


@pytest.mark.parametrize("demonstration_weight", [0.0, 2.0])
@pytest.mark.parametrize("layer_norm", [False, True])
def test_both_compositions_give_the_same_losses_and_gradients(layer_norm: bool, demonstration_weight: float) -> None:
    plain, fast = pair(layer_norm=layer_norm, demonstration_weight=demonstration_weight)
    batch = random_batch()
    torch.manual_seed(7)
    expected = gradients_of_sac(plain, batch)
    torch.manual_seed(7)
    losses = plain.losses(batch)
    torch.manual_seed(7)
    metrics = fast.compute_gradients(batch)
    torch.testing.assert_close(metrics["critic_loss"], losses["loss_qvalue"], rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(metrics["value"], losses["value"], rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(fast.log_alpha.grad, plain.loss.log_alpha.grad, rtol=1e-5, atol=1e-6)
    for mine, theirs in zip(gradients_of_fast(fast), expected, strict=True):
        torch.testing.assert_close(mine, theirs, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("demonstration_weight", [0.0, 2.0])
def test_both_compositions_stay_together_over_updates(demonstration_weight: float) -> None:
    plain, fast = pair(demonstration_weight=demonstration_weight)
    for index in range(20):
        batch = random_batch(seed=index)
        torch.manual_seed(index)
        expected = plain.update(batch)
        torch.manual_seed(index)
        metrics = fast.update(batch)
        for key, value in expected.items():
            torch.testing.assert_close(metrics[key], value, rtol=1e-3, atol=1e-4)
    for mine, theirs in zip(fast.policy().parameters(), plain.policy().parameters(), strict=True):
        torch.testing.assert_close(mine, theirs, rtol=1e-3, atol=2e-5)
    targets = torch.cat([p.reshape(2, -1) for n, p in plain.loss.state_dict().items() if n.startswith("target")], 1)
    assert fast.networks.target_master.double().norm().item() == pytest.approx(targets.double().norm().item(), rel=1e-4)


def test_without_demonstrations_the_loss_is_torchrls_own() -> None:
    plain, _ = pair()
    torch.manual_seed(7)
    losses = plain.losses(random_batch())
    own = SACLoss.actor_loss
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            ImitatingLoss, "actor_loss", lambda self, data: own(self, data.set("value", data["demonstrated"].float()))
        )
        torch.manual_seed(7)
        expected = plain.losses(random_batch())
    for key in ("loss_qvalue", "loss_actor", "loss_alpha", "alpha", "entropy"):
        torch.testing.assert_close(losses[key], expected[key], rtol=1e-6, atol=1e-7)
    mean = -losses["alpha"] * losses["entropy"] - losses["value"]
    torch.testing.assert_close(mean, expected["loss_actor"], rtol=1e-6, atol=1e-6)


def test_imitation_adds_the_gradient_of_better_demonstrated_actions_alone() -> None:
    batch, weight = random_batch(), 0.7
    _, fast = pair()
    torch.manual_seed(7)
    fast.compute_gradients(batch)
    before = [g.clone() for g in gradients_of_fast(fast)]
    torch.manual_seed(3)
    imitating = FastSac(SIZES, **SETTINGS, demonstration_weight=weight)
    torch.manual_seed(7)
    imitating.compute_gradients(batch)
    after = gradients_of_fast(imitating)

    actor = fast.policy().requires_grad_(True)
    torch.manual_seed(7)
    torch.randn(len(batch["action"]), SIZES.action)  # of the next actions
    mean, scale = actor(batch["observation"])
    proposed = torch.tanh(mean + scale * torch.randn(mean.shape)).detach()
    state = torch.cat((batch["observation"], batch["privileged"]), -1)

    def value(action: torch.Tensor) -> torch.Tensor:
        x = torch.cat((state, action), -1)
        return torch.minimum(*(critic.forward(x)[0] for critic in fast.networks.critics))

    better = (value(batch["action"]) > value(proposed)).float() * batch["demonstrated"]
    assert 0 < better.sum() < batch["demonstrated"].sum() < len(better)
    loss = weight * (better * (torch.tanh(mean) - batch["action"]).square()).sum() / len(better)
    expected = torch.autograd.grad(loss, list(actor.body.parameters()))
    for index, gradient in enumerate(expected):
        torch.testing.assert_close(after[index] - before[index], gradient, rtol=1e-4, atol=1e-6)
    for mine, same in zip(after[len(expected) :], before[len(expected) :], strict=True):
        assert torch.equal(mine, same)


def test_bfloat16_follows_float32_roughly() -> None:
    torch.manual_seed(3)
    exact = FastSac(SIZES, **SETTINGS)
    torch.manual_seed(3)
    rough = FastSac(SIZES, **(SETTINGS | {"precision": "bf16"}))
    batch = random_batch()
    for agent in (exact, rough):
        torch.manual_seed(7)
        agent.compute_gradients(batch)
    a, b = exact.networks.gradient, rough.networks.gradient.float()
    assert torch.nn.functional.cosine_similarity(a, b, dim=0) > 0.995
    assert not torch.equal(a, b)
    assert rough.approximations()
    assert not exact.approximations()


@pytest.mark.parametrize(("supported", "dtype"), [(True, torch.bfloat16), (False, torch.float32)])
def test_automatic_precision_is_what_the_processor_multiplies(
    supported: bool, dtype: torch.dtype, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tactile_cube.agent.settings.multiplies_bfloat16", lambda: supported)
    agent = FastSac(SIZES, **(SETTINGS | {"precision": "auto"}))
    assert agent.networks.working.dtype == dtype
    assert bool(agent.approximations()) == supported


def test_flat_perceptron_equals_torch_perceptron() -> None:
    torch.manual_seed(0)
    sizes = (5, 8, 6, 3)
    module = perceptron(sizes, layer_norm=True)
    flat = torch.zeros(parameter_count(sizes))
    network = FlatPerceptron(sizes, flat, None, layer_norm=True)
    network.copy_from(module)
    x = torch.randn(9, 5)
    torch.testing.assert_close(network.forward(x)[0], module(x))


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_the_gradient_of_relu_has_the_bits_of_torchs(dtype: torch.dtype) -> None:
    torch.manual_seed(0)
    gradient, after_relu = torch.randn(64, 32).to(dtype), torch.randn(64, 32).to(dtype).relu()
    expected = torch.ops.aten.threshold_backward(gradient, after_relu, 0.0)
    assert 0 < int((expected == 0.0).sum()) < expected.numel()
    assert torch.equal(rectify_gradient_(gradient, after_relu), expected)


def test_state_dict_restores_the_agent_bit_for_bit() -> None:
    for kind in (Sac, FastSac):
        torch.manual_seed(0)
        first = kind(SIZES, **SETTINGS)
        first.update(random_batch())
        stream = io.BytesIO()
        torch.save(first.state_dict(), stream)
        stream.seek(0)
        second = kind(SIZES, **SETTINGS)
        second.load_state_dict(torch.load(stream, weights_only=True))
        for agent in (first, second):
            torch.manual_seed(5)
            agent.update(random_batch(seed=2))
        for a, b in zip(first.policy().parameters(), second.policy().parameters(), strict=True):
            assert torch.equal(a, b)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_cuda_gives_the_gradients_of_the_cpu() -> None:
    torch.manual_seed(3)
    cpu = FastSac(SIZES, **SETTINGS)
    gpu = FastSac(SIZES, **(SETTINGS | {"device": "cuda"}))
    gpu.load_networks(cpu.state_dict())
    target = cpu._target(random_batch(), random_batch()["action"], torch.zeros(32, 1))
    batch = random_batch().to(torch.device("cuda"))
    on_gpu = gpu._target(batch, batch["action"], torch.zeros(32, 1, device="cuda"))
    torch.testing.assert_close(on_gpu.cpu(), target, rtol=1e-3, atol=1e-4)
    assert torch.isfinite(gpu.update(random_batch())["critic_loss"])
