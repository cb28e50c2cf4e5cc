"""The plain loss against TorchRL's SACLoss, and what it adds."""

import io
import re
from pathlib import Path
from typing import Any

import pytest
import torch
from tensordict import TensorDict

from tactile_cube.agent.agent import Agent
from tactile_cube.agent.networks import Sizes, lowest
from tactile_cube.agent.plain_sac import PlainSac
from tactile_cube.agent.sac import Sac
from tactile_cube.errors import InputError

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


def made(kind: type[Agent], **settings: Any) -> Agent:
    torch.manual_seed(3)
    return kind(SIZES, **(SETTINGS | settings))


def gradients(agent: Agent, batch: TensorDict) -> tuple[Any, list[torch.Tensor]]:
    """Losses, and the gradients of actor, critic 1, critic 2 and temperature."""
    torch.manual_seed(7)
    losses = agent.losses(batch)
    (losses["loss_qvalue"] + losses["loss_actor"] + losses["loss_alpha"]).backward()
    found = {name: p.grad for name, p in agent.loss.named_parameters() if p.requires_grad}
    temperature, actor = found.pop("log_alpha"), [g for name, g in found.items() if name.startswith("actor")]
    critics = [g for name, g in found.items() if not name.startswith("actor")]
    if isinstance(agent, Sac):  # which keeps both critics in one tensor
        critics = [*(g[0] for g in critics), *(g[1] for g in critics)]
    return losses, [*actor, *critics, temperature]


@pytest.mark.parametrize("layer_norm", [False, True])
def test_losses_and_gradients_are_those_of_torchrls_loss(layer_norm: bool) -> None:
    mine, own = gradients(made(PlainSac, layer_norm=layer_norm), random_batch())
    theirs, expected = gradients(made(Sac, layer_norm=layer_norm), random_batch())
    for key in ("loss_qvalue", "loss_actor", "alpha", "entropy", "value"):
        torch.testing.assert_close(mine[key], theirs[key], rtol=1e-5, atol=1e-6)
    assert len(own) == len(expected) == 19
    for a, b in zip(own, expected, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-6)


def test_both_agents_stay_together_over_updates() -> None:
    plain, torchrls = made(PlainSac), made(Sac)
    for index in range(20):
        results = []
        for agent in (plain, torchrls):
            torch.manual_seed(index)
            results.append(agent.update(random_batch(seed=index)))
        for key, value in results[1].items():
            torch.testing.assert_close(results[0][key], value, rtol=1e-3, atol=1e-4)
    for mine, theirs in zip(plain.policy().parameters(), torchrls.policy().parameters(), strict=True):
        torch.testing.assert_close(mine, theirs, rtol=1e-3, atol=2e-5)
    state, other = plain.state_dict()["loss"], torchrls.state_dict()["loss"]
    own = [state[f"targets.module.{critic}.body.0.weight"] for critic in (0, 1)]
    (targets,) = (value for key, value in other.items() if key.startswith("target") and key.endswith("body.0.weight"))
    torch.testing.assert_close(torch.stack(own), targets, rtol=1e-3, atol=2e-5)
    online = torch.stack([state[f"critics.{critic}.body.0.weight"] for critic in (0, 1)])
    assert not torch.allclose(online, targets, rtol=1e-3, atol=2e-5)


def test_imitation_adds_the_gradient_of_better_demonstrated_actions_alone() -> None:
    batch, weight = random_batch(), 0.7
    plain = made(PlainSac)
    _, before = gradients(plain, batch)
    _, after = gradients(made(PlainSac, demonstration_weight=weight), batch)
    actor = plain.policy().requires_grad_(True)
    torch.manual_seed(7)
    torch.randn(len(batch["action"]), SIZES.action)  # of the next actions
    drawn = actor.sample(batch["observation"])
    state = (plain.loss.critics, batch["observation"], batch["privileged"])
    better = (lowest(*state, batch["action"]) > lowest(*state, drawn.action)) & batch["demonstrated"]
    assert 0 < better.sum() < batch["demonstrated"].sum() < len(better)
    loss = weight * (better * (drawn.likeliest - batch["action"]).square()).sum() / len(better)
    expected = torch.autograd.grad(loss, list(actor.parameters()))
    for index, gradient in enumerate(expected):
        torch.testing.assert_close(after[index] - before[index], gradient, rtol=1e-4, atol=1e-6)
    for mine, same in zip(after[len(expected) :], before[len(expected) :], strict=True):
        assert torch.equal(mine, same)


def test_torchrls_losses_refuse_to_imitate() -> None:
    with pytest.raises(InputError, match=r"agent\.demonstration_weight=2.*agent=plain_sac"):
        made(Sac, demonstration_weight=2)


def test_bfloat16_follows_float32_roughly() -> None:
    batch, flat = random_batch(), []
    for precision in ("fp32", "bf16"):
        agent = made(PlainSac, precision=precision)
        assert bool(agent.approximations()) == (precision == "bf16")
        torch.manual_seed(7)
        start = torch.cat([p.flatten() for p in agent.policy().parameters()])
        agent.update(batch)
        flat.append(torch.cat([p.flatten() for p in agent.policy().parameters()]) - start)
    assert torch.nn.functional.cosine_similarity(*flat, dim=0) > 0.95
    assert not torch.equal(*flat)


@pytest.mark.parametrize(("supported", "dtype"), [(True, torch.bfloat16), (False, torch.float32)])
def test_automatic_precision_is_what_the_processor_multiplies(supported, dtype, monkeypatch) -> None:
    monkeypatch.setattr("tactile_cube.agent.agent.multiplies_bfloat16", lambda: supported)
    agent = made(PlainSac, precision="auto")
    assert agent.settings.product_dtype == dtype
    assert bool(agent.approximations()) == supported


def test_a_processor_without_bfloat16_is_told_what_is_faster(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tactile_cube.agent.agent.multiplies_bfloat16", lambda: False)
    assert "faster with agent.precision=fp32" in made(PlainSac, precision="bf16").approximations()[0]


@pytest.mark.parametrize("kind", [Sac, PlainSac])
def test_state_dict_restores_the_agent_bit_for_bit(kind: type[Agent]) -> None:
    first = made(kind)
    first.update(random_batch())
    stream = io.BytesIO()
    torch.save(first.state_dict(), stream)
    stream.seek(0)
    torch.manual_seed(1)
    second = kind(SIZES, **SETTINGS)
    second.load_state_dict(torch.load(stream, weights_only=True))
    for agent in (first, second):
        torch.manual_seed(5)
        agent.update(random_batch(seed=2))
    for a, b in zip(first.loss.state_dict().values(), second.loss.state_dict().values(), strict=True):
        assert torch.equal(a, b)


@pytest.mark.parametrize("kind", [Sac, PlainSac])
def test_a_warm_start_keeps_its_own_temperature(kind: type[Agent]) -> None:
    first, second = made(kind), made(kind, alpha_init=0.03)
    first.update(random_batch())
    second.load_networks(first.state_dict())
    assert second.loss.log_alpha.exp().item() == pytest.approx(0.03)
    for name, value in first.loss.state_dict().items():
        assert name == "log_alpha" or torch.equal(second.loss.state_dict()[name], value)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_cuda_gives_the_losses_of_the_cpu() -> None:
    cpu, gpu = made(PlainSac), made(PlainSac, device="cuda")
    gpu.load_networks(cpu.state_dict())
    batch = random_batch()
    batch["next", "terminated"].fill_(True)  # leaves nothing to chance in the target
    on_cpu = cpu.losses(batch)["loss_qvalue"]
    torch.testing.assert_close(gpu.losses(batch.to("cuda"))["loss_qvalue"].cpu(), on_cpu, rtol=1e-3, atol=1e-4)
    assert torch.isfinite(gpu.update(random_batch())["critic_loss"])


def test_the_loss_that_the_guide_writes_is_added() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "learn.md").read_text(encoding="utf-8")
    block = next(one for one in re.findall(r"```python\n(.*?)```", guide, flags=re.DOTALL) if "class MySac" in one)
    written: dict[str, Any] = {}
    exec(block, written)
    batch = random_batch()
    plain, mine = made(PlainSac), made(written["MySac"])
    torch.manual_seed(5)
    before = plain.losses(batch)
    torch.manual_seed(5)
    after = mine.losses(batch)
    added = 0.01 * plain.loss.actor.sample(batch["observation"]).likeliest.square().mean()
    assert torch.isclose(after["loss_actor"], before["loss_actor"] + added)
    assert torch.equal(after["loss_qvalue"], before["loss_qvalue"])
