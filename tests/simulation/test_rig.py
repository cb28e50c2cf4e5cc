from typing import Literal

import numpy as np
import pybullet
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import MOTOR_POSITION, TORQUE, find_effect
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.simulation import RigWorld

SIGNALS = np.array([MOTOR_POSITION, TORQUE])


def commands(rows: int, joints: int) -> np.ndarray:
    time = 0.002 * np.arange(rows)[:, None]
    return 0.3 * np.sin(2 * np.pi * time * (1.0 + 0.7 * np.arange(joints))) + 0.2


def both(plant: Plant, memory: np.ndarray, rows: int = 400, history: int = 0) -> tuple[np.ndarray, np.ndarray]:
    sent = commands(rows + history, plant.topology.joints)
    fast = np.empty((rows, 2, plant.topology.joints))
    plant.kernel.rollout(sent, history, 1, memory.copy(), SIGNALS, fast)
    slow = np.empty_like(fast)
    world = RigWorld(plant)
    memory = memory.copy()
    plant.kernel.rollout(sent[:history], history, 1, memory, SIGNALS, slow[:0])
    world.rollout(sent[history:], memory, SIGNALS, slow)
    world.close()
    return fast, slow


def finger_plant(*effects: str) -> Plant:
    return Plant([RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0))], 0.002, [find_effect(name) for name in effects])


@pytest.mark.parametrize("sign", ["physical", "printed"])
def test_free_motion_in_bullet_agrees_with_the_fast_rollout(sign: Literal["physical", "printed"]) -> None:
    plant = finger_plant()
    constants = DrivetrainConstants(sign=sign, reflected_inertia=(1.5e-3, 2e-3, 3e-3))
    memory = plant.memory(constants, gravity=(3.0, -2.0, -9.0))
    plant.reset(memory, np.array([0.1, 0.2, 0.3]), np.array([1.0, -1.0, 0.5]))
    fast, slow = both(plant, memory)
    assert np.abs(fast[:, 0]).max() > 0.3
    np.testing.assert_allclose(slow, fast, atol=1e-9)


def test_the_whole_hand_branches_and_moves_in_bullet_too() -> None:
    plant = Plant([RigidBodyTree.from_urdf(DLR_HAND2.urdf(), DLR_HAND2.joint_names)], 0.002)
    memory = plant.memory(DrivetrainConstants(), gravity=(3.0, -2.0, -9.0))
    plant.reset(memory, np.linspace(0.1, 0.5, 12))
    fast, slow = both(plant, memory, rows=100)
    assert np.ptp(fast[:, 0], axis=0).min() > 0.02
    np.testing.assert_allclose(slow, fast, atol=1e-9)


def test_it_is_bullet_that_moves_the_rig() -> None:
    plant = finger_plant()
    memory = plant.memory(DrivetrainConstants())
    world = RigWorld(plant)
    out, heavier = np.empty((50, 2, 3)), np.empty((50, 2, 3))
    world.rollout(commands(50, 3), memory, SIGNALS, out)
    pybullet.changeDynamics(world._body, 1, mass=1.0, physicsClientId=world._client)
    world.rollout(commands(50, 3), memory, SIGNALS, heavier)
    assert np.abs(out - heavier).max() > 1e-3
    world.close()


def test_mechanism_and_command_effects_reach_bullet() -> None:
    plant = finger_plant("payload", "command_delay", "stribeck_friction")
    payload, delay, friction = plant.effects
    effects = [payload("q3"), delay("q2"), friction("q1")]
    memory = plant.memory(DrivetrainConstants(), effects=effects)
    fast, slow = both(plant, memory, history=20)
    plain, _ = both(plant, plant.memory(DrivetrainConstants()))
    np.testing.assert_allclose(slow, fast, atol=1e-9)
    assert np.abs(fast - plain).max() > 1e-3


def test_posture_offsets_move_into_the_frames() -> None:
    plant = finger_plant()
    memory = plant.memory(DrivetrainConstants())
    plant.view(memory, "offset")[0] = [0.05, -0.1, 0.2, 0.2]
    fast, slow = both(plant, memory)
    np.testing.assert_allclose(slow, fast, atol=1e-9)


def test_a_hand_of_several_chains_is_refused() -> None:
    tree = RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0))
    with pytest.raises(InputError, match="moves one chain, this plant has 2"):
        RigWorld(Plant([tree, tree], 0.002))
