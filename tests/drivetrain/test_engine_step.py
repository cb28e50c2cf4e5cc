"""The control step for an engine: what it feels of contacts, its target filter, its trace."""

import dataclasses

import numpy as np
import pybullet

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.simulation import SimulationOptions
from tactile_cube.simulation.bullet_engine import connect, load_chain
from tests.drivetrain.rigs import finger, finger_text

SPIN = np.array([1.5e-3, 1e-3, 1e-3, 0.5e-3])
START = np.array([0.1, 0.3, 0.2])
GRAVITY = (1.0, 2.0, -9.81)
DT = 0.002


def prepared(plant: Plant, constants: DrivetrainConstants) -> np.ndarray:
    memory = plant.memory(constants, gravity=GRAVITY)
    plant.view(memory, "spin_inertia")[:] = SPIN
    plant.view(memory, "tendon_stiffness")[:] = 15.0
    plant.view(memory, "tendon_damping")[:] = 0.02
    for key in ("rate_limit", "command_torque_limit"):
        plant.view(memory, key)[:] = np.inf
    plant.reset(memory, START)
    return memory


def joint_load(q: np.ndarray, force: list[float]) -> np.ndarray:
    """J^T f of a force at the distal link's centre of mass: minus the weight of a unit mass there."""
    unit = dataclasses.replace(finger(), mass=np.array([0.0, 0.0, 0.0, 1.0]))
    return -unit.equations(q, np.zeros(4), np.array(force))[1]


def test_a_force_on_the_fingertip_is_felt_with_the_inertia_of_the_rotors() -> None:
    """Against the free simulation with the force's exact joint torques; the estimate is one step late."""
    plant = Plant([finger()], DT)
    memory = prepared(plant, DrivetrainConstants())
    free, torque = memory.copy(), np.zeros(4)
    client = connect(SimulationOptions(dt=DT))
    body = load_chain(client, finger_text(), np.zeros(3), np.eye(3))
    pybullet.setGravity(*GRAVITY, physicsClientId=client)
    for k, axis in enumerate(finger().axis):
        inertia = np.array(pybullet.getDynamicsInfo(body, k, physicsClientId=client)[2]) + SPIN[k] * axis
        pybullet.changeDynamics(body, k, localInertiaDiagonal=inertia.tolist(), physicsClientId=client)
        pybullet.resetJointState(body, k, [*START, START[2]][k], physicsClientId=client)
    force, coupling = [0.0, 0.6, 0.3], finger().coupling
    for i in range(500):
        states = pybullet.getJointStates(body, range(4), physicsClientId=client)
        q, v = (np.array([state[part] for state in states]) for part in (0, 1))
        plant.kernel.control_step(0, q, v, torque, memory)
        tip = pybullet.getLinkState(body, 3, computeForwardKinematics=True, physicsClientId=client)[0]
        if i > 50:
            pybullet.applyExternalForce(body, 3, force, tip, pybullet.WORLD_FRAME, physicsClientId=client)
        load = coupling.T @ joint_load(q, force) * (i > 50)
        plant.view(free, "external_torque")[:] = load
        torques = {"forces": torque.tolist(), "physicsClientId": client}
        pybullet.setJointMotorControlArray(body, range(4), pybullet.TORQUE_CONTROL, **torques)
        pybullet.stepSimulation(physicsClientId=client)
        plant.kernel.step(START, free)
    pybullet.disconnect(client)
    np.testing.assert_allclose(q[:3], plant.view(free, "q"), atol=3e-3)
    np.testing.assert_allclose(plant.view(memory, "contact"), load, atol=2e-3)
    assert np.max(np.abs(load)) > 0.02


def test_the_target_filter_runs_at_the_rate_of_the_physics() -> None:
    plant = Plant([finger()], DT)
    memory = plant.memory(DrivetrainConstants(rate_limit=1.0))
    plant.view(memory, "time_constant")[:] = 0.1
    plant.view(memory, "goal")[:] = 0.3
    q, torque = np.zeros(4), np.zeros(4)
    for _ in range(25):
        plant.kernel.control_step(0, q, q, torque, memory)
    np.testing.assert_allclose(plant.view(memory, "filtered"), 0.3 * (1 - np.exp(-0.5)), rtol=1e-12)
    np.testing.assert_allclose(plant.view(memory, "limited"), 0.05, rtol=1e-12)


def test_the_trace_keeps_every_step_s_signals() -> None:
    plant = Plant([finger()], DT, trace_rows=3)
    memory = plant.memory(DrivetrainConstants())
    q, torque, expected = np.zeros(4), np.zeros(4), []
    for i in range(3):
        plant.view(memory, "goal")[:] = 0.1 * i
        plant.kernel.control_step(i, q, q, torque, memory)
        expected.append(plant.view(memory, "signals").copy())
    assert np.array_equal(plant.view(memory, "trace"), expected)
