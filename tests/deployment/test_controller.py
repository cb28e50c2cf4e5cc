"""The deployed controller against the training environment."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, save_policy
from tactile_cube.deployment.controller import Network, PolicyController, read_network
from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import ActorPolicy
from tactile_cube.evaluation.rollout import run_episode
from tactile_cube.transforms import EnvConfig, make_env


def make_network(folder: Path) -> tuple[Actor, Network]:
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 0, 12), (512, 512))
    save_policy(folder / "policy.safetensors", actor, PolicyInfo.describe(actor, time_constant=0.5))
    return actor, read_network(folder / "policy.safetensors")


def test_the_controller_asks_for_what_the_policy_does_in_simulation(tmp_path: Path) -> None:
    """A whole undisturbed episode: readings of the world in, q_n out, equal to what the environment executed."""
    actor, network = make_network(tmp_path)
    env = make_env(EnvConfig(Task("full", episode_steps=12)), 1, 0, evaluation=True)
    readings = []

    class Listening(ActorPolicy):
        def act(self, observation: np.ndarray, step: int) -> np.ndarray:
            world = env.base_env.tasks[0].world
            readings.append((np.array(world.q_m), np.array(world.q_f)))
            return super().act(observation, step)

    record = run_episode(env, Listening(actor), 0)
    env.close()
    controller = PolicyController(network)
    controller.reset()
    targets = [controller.step(q_m, q_f) for q_m, q_f in readings]
    np.testing.assert_allclose(targets, record.target, atol=1e-5)


def test_reset_forgets_the_past(tmp_path: Path) -> None:
    controller = PolicyController(make_network(tmp_path)[1])
    first = controller.step(np.full(12, 0.1), np.full(12, 0.2))
    assert not np.array_equal(controller.step(np.zeros(12), np.zeros(12)), first)
    controller.reset()
    np.testing.assert_array_equal(controller.step(np.full(12, 0.1), np.full(12, 0.2)), first)


def test_a_policy_of_another_shape_is_refused() -> None:
    weight, bias = np.zeros((24, 100), dtype=np.float32), np.zeros(24, dtype=np.float32)
    with pytest.raises(InputError, match="maps 100 numbers to 12"):
        PolicyController(Network((weight,), (bias,), {}))


def test_the_robots_computer_needs_no_torch() -> None:
    program = (
        "import sys, tactile_cube.deployment.controller, tactile_cube.deployment.export; print('torch' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout.strip() == "False"


def test_numpy_and_torch_give_the_same_action(tmp_path: Path) -> None:
    actor, network = make_network(tmp_path)
    observation = np.random.default_rng(1).normal(0.0, 0.5, (50, 120)).astype(np.float32)
    with torch.no_grad():
        expected = actor.deterministic(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(network(observation), expected, atol=2e-6)
    assert network.info["time_constant"] == 0.5
