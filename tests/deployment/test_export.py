import json
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.deployment.export import export_policy
from tactile_cube.deployment.network import Network
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2


@pytest.fixture
def network() -> Network:
    rng = np.random.default_rng(0)
    shapes = ((32, 120), (32, 32), (24, 32))
    weights = tuple(rng.normal(0.0, 0.2, shape).astype(np.float32) for shape in shapes)
    biases = tuple(rng.normal(0.0, 0.2, shape[0]).astype(np.float32) for shape in shapes)
    return Network(weights, biases, {"time_constant": 0.5, "seed": 3, "config": {"large": True}})


@pytest.fixture
def observation() -> np.ndarray:
    return np.random.default_rng(1).normal(0.0, 0.5, (7, 120)).astype(np.float32)


def test_exported_arrays_are_the_network(network: Network, observation: np.ndarray, tmp_path: Path) -> None:
    export_policy(network, tmp_path / "policy.npz")
    arrays = np.load(tmp_path / "policy.npz")
    signal = observation
    for layer in range(2):
        signal = np.maximum(signal @ arrays[f"weight{layer}"].T + arrays[f"bias{layer}"], 0.0)
    action = np.tanh(signal @ arrays["weight2"].T + arrays["bias2"])
    np.testing.assert_allclose(action, network(observation), atol=1e-6)


def test_the_onnx_graph_is_the_network(network: Network, observation: np.ndarray, tmp_path: Path) -> None:
    reference = pytest.importorskip("onnx.reference")
    export_policy(network, tmp_path / "policy.onnx")
    (action,) = reference.ReferenceEvaluator(str(tmp_path / "policy.onnx")).run(None, {"observation": observation})
    np.testing.assert_allclose(action, network(observation), atol=1e-5)


def test_the_contract_says_what_a_robot_must_know(network: Network, tmp_path: Path) -> None:
    contract = json.loads(export_policy(network, tmp_path / "policy.npz").read_text())
    assert contract["joints"] == list(DLR_HAND2.joint_names)
    assert contract["observation"]["readings"] == 5
    assert contract["action"]["upper"] == list(DLR_HAND2.action_upper)
    assert contract["target_filter"]["time_constant_s"] == 0.5
    assert "config" not in contract["policy"]


def test_an_unknown_ending_is_refused(network: Network, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.pt"):
        export_policy(network, tmp_path / "policy.pt")
