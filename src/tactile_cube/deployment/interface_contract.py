"""What a robot's program must know to run an exported policy: order, units, scaling and rates, as plain data."""

from __future__ import annotations

from typing import Any

from tactile_cube.deployment.controller import POLICY_RATE, READING
from tactile_cube.deployment.network import Network
from tactile_cube.hand import DLR_HAND2, HandModel


def interface_contract(network: Network, hand: HandModel = DLR_HAND2) -> dict[str, Any]:
    """Return the contract of a policy, ready for JSON."""
    names = list(hand.joint_names)
    return {
        "format": "tactile_cube contract 1",
        "joints": names,
        "observation": {
            "name": "observation",
            "shape": [network.observation_size],
            "dtype": "float32",
            "readings": network.observation_size // READING,
            "order": "oldest reading first; a reading is q_m then e_q = q_f - q_m, joints in the order of `joints`",
            "unit": "rad, not scaled",
            "at_start": "the first reading fills all places",
        },
        "action": {
            "name": "action",
            "shape": [network.action_size],
            "dtype": "float32",
            "range": [-1.0, 1.0],
            "meaning": "q_n = 0.5 * (lower + upper) + 0.5 * (upper - lower) * action, desired joint angles",
            "lower": [float(value) for value in hand.action_lower],
            "upper": [float(value) for value in hand.action_upper],
            "unit": "rad",
        },
        "rates": {
            "policy_hz": POLICY_RATE,
            "fast_loop_hz": {"simulation": 500, "robot": 1000},
        },
        "target_filter": {
            "law": "q_f += (1 - exp(-dt / T_s)) * (q_n - q_f), in the fast loop; starts at the measured angles",
            "time_constant_s": network.info.get("time_constant"),
        },
        "impedance": "tau = K_P (q_d - q_m) - K_D dq with q_d = q_f after rate and torque limits",
        "policy": {key: value for key, value in network.info.items() if key != "config"},
    }
