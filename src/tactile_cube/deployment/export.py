"""A policy as files that need none of this package: arrays or an ONNX graph, with the contract beside them."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tactile_cube.deployment.control_loop import Homing
from tactile_cube.deployment.controller import POLICY_RATE, Network
from tactile_cube.deployment.robot import RATE, StopRules
from tactile_cube.deployment.training_setting import TrainingSetting, training_setting
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.whole_file import write_json, write_npz, write_whole, written_together

FORMAT = "tactile_cube contract 3"
FINGER = {
    "q1": "abduction, 0 is straight",
    "q2": "positive flexes, 0 is straight",
    "q3": "positive flexes, 0 is straight",
}
TOLERANCE = 1e-5  # between float32 products in different orders


def interface_contract(network: Network, setting: TrainingSetting | None = None) -> dict[str, Any]:
    """Return the contract of a policy, ready for JSON; `setting` is that of its training, None: as its file says."""
    setting = setting or training_setting(network.info, label=network.label)
    hand, constants = setting.hand, setting.constants
    names = list(hand.joint_names)
    known = hand.name == DLR_HAND2.name  # else what a joint does stands in its URDF
    meanings = [FINGER[name[-2:]] if known else "as in the URDF of the hand" for name in names]
    return {
        "format": FORMAT,
        "hand": _hand(setting),
        "joints": names,
        "joint_convention": {
            name: {"unit": "rad", "zero": 0.0, "direction": 1, "meaning": meaning}
            for name, meaning in zip(names, meanings, strict=True)
        },
        "joint_range": {"lower": _plain(hand.lower), "upper": _plain(hand.upper), "unit": "rad"},
        "task": _task(setting),
        "start_angles": {"angles": _plain(hand.start_angles), "unit": "rad", "homing": asdict(Homing())},
        "observation": {
            "name": "observation",
            "shape": ["batch", network.observation_size],
            "dtype": "float32",
            "readings": network.observation_size // (2 * hand.joints),
            "order": "oldest reading first; a reading is q_m then e_q = q_f - q_m, joints in the order of `joints`",
            "unit": "rad, not scaled",
            "at_start": "the first reading fills all places",
        },
        "action": {
            "name": "action",
            "shape": ["batch", network.action_size],
            "dtype": "float32",
            "range": [-1.0, 1.0],
            "meaning": "q_n = 0.5 * (lower + upper) + 0.5 * (upper - lower) * action, desired joint angles",
            "lower": _plain(hand.action_lower),
            "upper": _plain(hand.action_upper),
            "unit": "rad",
        },
        "rates": {"policy_hz": POLICY_RATE, "fast_loop_hz": {"simulation": 500, "robot": 1000}},
        "target_filter": {
            "law": "q_f += (1 - exp(-dt / T_s)) * (q_n - q_f), in the fast loop; starts at the measured angles",
            "time_constant_s": network.info.get("time_constant"),
        },
        "limits": {
            "law": "the q_d nearest to q_f within joint_range, the rate since the last q_d and the torque, all at once",
            "rate": {"value": RATE, "unit": "rad/s"},
            "torque": {"value": constants.torque_limit, "unit": "N m"},
            "torque_law": "q_d in [q_m - limit / K_P, q_m + limit / K_P], q_m as last accepted",
        },
        "impedance": {
            "law": "tau = K_P (q_d - q_m) - K_D dq with q_d = q_f after the limits",
            "kp": {"value": _alike(constants.kp), "unit": "N m/rad"},
            "kd": {"value": _alike(constants.kd), "unit": "N m s/rad"},
        },
        "stop": {
            "rules": asdict(StopRules()),
            "unit": {"margin": "rad", "speed": "rad/s", "tolerance": "N m", "all others": "s"},
            "accepted": "a q_m stamped within silence of now, in range by margin, no further from the last than speed "
            "allows, around which a q_d keeps all limits; else q_f stays for this tick",
            "then": "q_d to the last accepted angles, within the limits, until K_P |q_d - q_m| is below tolerance",
            "robot_side": "without a q_d for timeout, the robot's own controller takes q_m for q_d",
        },
        "test_vector": _test_vector(network, hand) | {"tolerance": TOLERANCE},
        "sha256": {"weights": weights_hash(network), "of": "weight0, bias0, weight1, ... as little-endian float32"},
        "policy": {key: value for key, value in network.info.items() if key != "config"},
    }


def _hand(setting: TrainingSetting) -> dict[str, Any]:
    hand, constants = setting.hand, setting.constants
    tips = [hand.finger_tips(k, hand.start_angles[None, hand.of_finger(k)])[0] for k in range(len(hand.fingers))]
    return {
        "name": hand.name,
        "urdf": {"file": hand.urdf_name, "sha256": hand.urdf_sha256},
        "coupled_joints": [
            {"joint": hand.chain_joints(k)[link], "follows": hand.chain_joints(k)[leader], "ratio": 1.0}
            for k in range(len(hand.fingers))
            for link, leader in hand.coupled()
        ],
        "palm": {
            "position": {"value": _plain(hand.position), "unit": "m"},
            "rotation": [_plain(row) for row in hand.rotation],
            "frame": "of the URDF's root link in the world: p_world = position + rotation @ p_palm",
            "gravity": {"value": _plain(constants.gravity * hand.rotation.T @ constants.down), "unit": "m/s^2"},
            "gravity_frame": "palm; hold the hand so that it is this",
        },
        "fingertips": [
            {
                "finger": finger.name,
                "link": finger.links[-1],
                "radius": hand.tip_radius,
                "at_start": _plain(hand.rotation.T @ (tip - hand.position)),
            }
            for k, (finger, tip) in enumerate(zip(hand.fingers, tips, strict=True))
        ],
        "fingertips_unit": "m; at_start: centre of the sphere in the palm's frame at the start angles",
    }


def _task(setting: TrainingSetting) -> dict[str, Any]:
    constants, task = setting.constants, setting.task
    return {
        "object": {
            "shape": str(constants.object_shape),
            "size": {"value": _plain(constants.cube_size), "unit": "m, edges of its bounding box"},
            "mass": {"value": constants.cube_mass, "unit": "kg"},
            "centre_of_mass": {"value": _plain(constants.cube_com), "unit": "m, from the middle of the bounding box"},
            "friction": {"object": constants.cube_friction, "fingertips": constants.tip_friction, "law": "product"},
        },
        "axis": _plain(task.axis_vector()),
        "direction": task.direction,
        "frame": "world: origin in the object's middle at the start, z up; +1 is the right-handed sense about axis",
        "on_a_table": task.table,
    }


def weights_hash(network: Network) -> str:
    """Return the SHA-256 of the weights and biases that give the action."""
    digest = hashlib.sha256()
    for weight, bias in network.deterministic_layers():
        digest.update(np.ascontiguousarray(weight, dtype="<f4").tobytes())
        digest.update(np.ascontiguousarray(bias, dtype="<f4").tobytes())
    return digest.hexdigest()


def _test_vector(network: Network, hand: Hand) -> dict[str, Any]:
    """Return an observation without zeros, and the action that belongs to it."""
    places = np.arange(network.observation_size)
    rest = np.resize([*hand.start_angles, *np.zeros(hand.joints)], network.observation_size)
    observation = (rest + 0.05 * np.sin(1.0 + places)).astype(np.float32)
    return {"observation": _plain(observation), "action": _plain(network(observation))}


def _plain(values: Any) -> list[float]:
    return [float(value) for value in values]


def _alike(values: Any) -> float | list[float]:
    """Return one number if it is the same for all joints, else one each."""
    numbers = _plain(values)
    return numbers[0] if len(set(numbers)) == 1 else numbers


def export_policy(network: Network, path: Path, setting: TrainingSetting | None = None) -> Path:
    """Write the network, `.npz` or `.onnx`, and `<path>.contract.json` beside it; return the contract's path.

    Raises:
        InputError: unknown ending, or ONNX is not installed.
    """
    writers = {".npz": _write_npz, ".onnx": _write_onnx}
    if path.suffix not in writers:
        raise InputError(f"output={path}: ending {path.suffix!r} is unknown; choose one of {', '.join(writers)}")
    contract = interface_contract(network, setting)
    beside = path.with_name(f"{path.name}.contract.json")
    with written_together(path.parent, beside.name) as aside:
        file = aside / path.name
        writers[path.suffix](network, contract, file)
        contract["sha256"] |= {path.name: hashlib.sha256(file.read_bytes()).hexdigest()}
        write_json(aside / beside.name, contract)
    return beside


def _write_npz(network: Network, contract: dict[str, Any], path: Path) -> None:
    """Write `weight<k>` (out, in) and `bias<k>` (out,), ReLU between layers, tanh after the last, and `contract`."""
    arrays: dict[str, Any] = {"contract": np.array(json.dumps(contract))}
    for index, (weight, bias) in enumerate(network.deterministic_layers()):
        arrays |= {f"weight{index}": weight, f"bias{index}": bias}
    write_npz(path, arrays, compressed=False)


def _write_onnx(network: Network, contract: dict[str, Any], path: Path) -> None:
    """Write a graph "observation" (batch, 120) -> "action" (batch, 12), the contract in its metadata."""
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError:
        raise InputError(
            f"output={path}: ONNX is not installed; pip install 'tactile-cube[onnx]' or export .npz"
        ) from None
    layers = network.deterministic_layers()
    nodes, weights, signal = [], [], "observation"
    for index, (weight, bias) in enumerate(layers):
        last = index == len(layers) - 1
        weights += [numpy_helper.from_array(weight, f"weight{index}"), numpy_helper.from_array(bias, f"bias{index}")]
        inputs = [signal, f"weight{index}", f"bias{index}"]
        signal = "action" if last else f"hidden{index}"
        nodes.append(helper.make_node("Gemm", inputs, [f"linear{index}"], transB=1))
        nodes.append(helper.make_node("Tanh" if last else "Relu", [f"linear{index}"], [signal]))
    observation = helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["batch", network.observation_size])
    action = helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", network.action_size])
    graph = helper.make_graph(nodes, "tactile_cube", [observation], [action], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {"tactile_cube.contract": json.dumps(contract)})
    onnx.checker.check_model(model)
    write_whole(path, model.SerializeToString())
