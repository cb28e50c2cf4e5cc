"""A policy as files that need none of this package: arrays or an ONNX graph, with the contract beside them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from tactile_cube.deployment.interface_contract import interface_contract
from tactile_cube.deployment.network import Network
from tactile_cube.deployment.training_setting import TrainingSetting
from tactile_cube.errors import InputError

OPSET = 17
FORMATS = ("npz", "onnx")
METADATA = "tactile_cube.contract"
"""Key of the contract in the metadata of an ONNX file."""
Contract = dict[str, Any]


def export_policy(network: Network, path: Path, setting: TrainingSetting | None = None) -> Path:
    """Write the network, `.npz` or `.onnx`, and `<path>.contract.json` beside it; return the contract's path.

    Args:
        network: the policy.
        path: file to write.
        setting: that it was trained in; None: as its file says.

    Raises:
        InputError: unknown ending, or ONNX is not installed.
    """
    writers = {".npz": _write_npz, ".onnx": _write_onnx}
    if path.suffix not in writers:
        raise InputError(f"output={path}: ending {path.suffix!r} is unknown; choose one of {', '.join(writers)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    contract = interface_contract(network, setting)
    writers[path.suffix](network, contract, path)
    contract["sha256"] |= {path.name: hashlib.sha256(path.read_bytes()).hexdigest()}
    beside = path.with_name(f"{path.name}.contract.json")
    beside.write_text(json.dumps(contract, indent=1), encoding="utf-8")
    return beside


def _write_npz(network: Network, contract: Contract, path: Path) -> None:
    """Write `weight<k>` (out, in) and `bias<k>` (out,), ReLU between layers, tanh after the last, and `contract`."""
    arrays: dict[str, Any] = {"contract": np.array(json.dumps(contract))}
    for index, (weight, bias) in enumerate(network.deterministic_layers()):
        arrays |= {f"weight{index}": weight, f"bias{index}": bias}
    np.savez(path, **arrays)


def _write_onnx(network: Network, contract: Contract, path: Path) -> None:
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
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    helper.set_model_props(model, {METADATA: json.dumps(contract)})
    onnx.checker.check_model(model)
    onnx.save(model, path)
