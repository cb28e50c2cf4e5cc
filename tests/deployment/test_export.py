import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.deployment import export
from tactile_cube.deployment.control_loop import ControlLoop, Homing
from tactile_cube.deployment.controller import Network, PolicyController
from tactile_cube.deployment.export import export_policy, interface_contract
from tactile_cube.deployment.robot import JointLimits, Reading, StopRules
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, tip_positions


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


def test_the_onnx_graph_is_the_network_and_carries_the_contract(network, observation, tmp_path) -> None:
    onnx, reference = pytest.importorskip("onnx"), pytest.importorskip("onnx.reference")
    path = tmp_path / "policy.onnx"
    beside = json.loads(export_policy(network, path).read_text())
    (action,) = reference.ReferenceEvaluator(str(path)).run(None, {"observation": observation})
    np.testing.assert_allclose(action, network(observation), atol=1e-5)
    entries = {one.key: one.value for one in onnx.load(path).metadata_props}
    del beside["sha256"]["policy.onnx"]
    assert json.loads(entries["tactile_cube.contract"]) == beside


def test_the_contract_says_which_hand_it_is_and_how_it_is_held(network: Network) -> None:
    """A robot is set up from this alone: the tips are where its own kinematics put them, gravity where it pulls."""
    contract = interface_contract(network)["hand"]
    assert contract["urdf"]["sha256"] == hashlib.sha256(DLR_HAND2.urdf().encode()).hexdigest()
    assert contract["coupled_joints"][0] == {"joint": "ring_q4", "follows": "ring_q3", "ratio": 1.0}
    rotation = np.array(contract["palm"]["rotation"])
    np.testing.assert_allclose(rotation @ contract["palm"]["gravity"]["value"], [0.0, 0.0, -9.81], atol=1e-12)
    at_start = np.array([tip["at_start"] for tip in contract["fingertips"]])
    in_world = contract["palm"]["position"]["value"] + at_start @ rotation.T
    np.testing.assert_allclose(in_world, tip_positions(DLR_HAND2, DLR_HAND2.start_angles), atol=1e-9)
    sides = np.array([finger.face for finger in DLR_HAND2.fingers])
    gaps = (in_world * sides).sum(axis=1) - 0.04 - [tip["radius"] for tip in contract["fingertips"]]
    np.testing.assert_allclose(gaps, 0.001, atol=1e-3)  # 1 mm off a cube of 8 cm, by angles rounded to 0.1 deg


def test_every_exported_file_has_a_contract_of_its_own(network, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(export, "_write_onnx", lambda network, contract, path: path.write_bytes(b"a graph"))
    beside = [export_policy(network, tmp_path / name) for name in ("policy.npz", "policy.onnx")]
    assert [path.name for path in beside] == ["policy.npz.contract.json", "policy.onnx.contract.json"]
    for path in beside:
        file = path.with_name(path.name.removesuffix(".contract.json"))
        assert json.loads(path.read_text())["sha256"][file.name] == hashlib.sha256(file.read_bytes()).hexdigest()


def test_an_unknown_ending_is_refused(network: Network, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.pt"):
        export_policy(network, tmp_path / "policy.pt")


def test_the_test_vector_and_the_hashes_tell_whether_a_file_is_what_was_exported(network, tmp_path) -> None:
    path = tmp_path / "policy.npz"
    contract = json.loads(export_policy(network, path).read_text())
    assert "config" not in contract["policy"]
    vector = contract["test_vector"]
    action = network(np.array(vector["observation"], dtype=np.float32))
    np.testing.assert_allclose(action, vector["action"], atol=vector["tolerance"])
    assert np.abs(vector["observation"]).min() > 0
    other = Network((network.weights[0] + 1e-3, *network.weights[1:]), network.biases, network.info)
    assert interface_contract(other)["sha256"]["weights"] != contract["sha256"]["weights"]


def test_a_loop_written_from_the_contract_alone_sends_what_ours_sends(network: Network, tmp_path: Path) -> None:
    """Everything below reads the two files; of the package only the loop it is compared with."""
    export_policy(network, tmp_path / "policy.npz")
    contract = json.loads((tmp_path / "policy.npz.contract.json").read_text())
    arrays = np.load(tmp_path / "policy.npz")
    lower, upper = (np.array(contract["action"][key]) for key in ("lower", "upper"))
    low, high = (np.array(contract["joint_range"][key]) for key in ("lower", "upper"))
    kp, kd = (contract["impedance"][key]["value"] for key in ("kp", "kd"))
    rate, torque = (contract["limits"][key]["value"] for key in ("rate", "torque"))
    readings, keep = (
        contract["observation"]["readings"],
        1.0 - np.exp(-1e-3 / contract["target_filter"]["time_constant_s"]),
    )
    home = np.array(contract["start_angles"]["angles"])

    def policy(observation: np.ndarray) -> np.ndarray:
        hidden = np.maximum(arrays["weight0"] @ observation + arrays["bias0"], 0)
        hidden = np.maximum(arrays["weight1"] @ hidden + arrays["bias1"], 0)
        return np.tanh(arrays["weight2"] @ hidden + arrays["bias2"])

    gains = (np.full(12, kp), np.full(12, kd))
    limits = JointLimits(DLR_HAND2.lower, DLR_HAND2.upper, rate, torque, *gains)
    loop = ControlLoop(PolicyController(network), 0.5, limits, StopRules(), Homing(settle=1e-3), seconds=1.0)
    for tick in range(-4, 1):  # five that agree before the first command
        loop.tick(1e-3 * tick, Reading(1e-3 * tick, home))
        loop.sent()
    stack, q_f, q_d, q_m = None, home, home, home
    for tick in range(1, 500):
        ours = loop.tick(1e-3 * tick, Reading(1e-3 * tick, q_m))
        loop.sent()
        if (tick - 1) % 100 == 0:
            reading = np.concatenate([q_m, q_f - q_m])
            stack = np.tile(reading, readings) if stack is None else np.concatenate([stack[24:], reading])
            q_n = 0.5 * (lower + upper) + 0.5 * (upper - lower) * policy(stack.astype(np.float32))
        q_f = q_f + keep * (q_n - q_f)
        wanted = np.clip(np.clip(q_f, low, high), q_d - rate * 1e-3, q_d + rate * 1e-3)
        q_d = np.clip(wanted, q_m - torque / kp, q_m + torque / kp)
        np.testing.assert_allclose(ours, q_d, atol=1e-6)
        q_m = q_m + 0.02 * (q_d - q_m)
    assert np.abs(q_d - home).max() > 0.02
