"""The control step drives Bullet's finger exactly as the free simulation moves the model."""

import dataclasses

import numpy as np
import pybullet
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import MOTOR_POSITION, TORQUE
from tests.drivetrain.rigs import finger, finger_text

SPIN = np.array([1.5e-3, 1e-3, 1e-3, 0.5e-3])
START = np.array([0.1, 0.3, 0.2])
GRAVITY = (1.0, 2.0, -9.81)
DT = 0.002


class BulletFinger:
    """The finger in PyBullet: no damping, no motors, spin inertia on the links."""

    def __init__(self, path) -> None:
        path.write_text(finger_text())
        self.client = pybullet.connect(pybullet.DIRECT)
        on = {"physicsClientId": self.client}
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self.body = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, **on)
        pybullet.setGravity(*GRAVITY, **on)
        pybullet.setTimeStep(DT, **on)
        for k, axis in enumerate(finger().axis):
            inertia = np.array(pybullet.getDynamicsInfo(self.body, k, **on)[2]) + SPIN[k] * axis
            pybullet.changeDynamics(
                self.body,
                k,
                localInertiaDiagonal=inertia.tolist(),
                linearDamping=0,
                angularDamping=0,
                jointDamping=0,
                **on,
            )
            pybullet.setJointMotorControl2(self.body, k, pybullet.VELOCITY_CONTROL, force=0, **on)
            pybullet.resetJointState(self.body, k, [*START, START[2]][k], **on)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        states = pybullet.getJointStates(self.body, range(4), physicsClientId=self.client)
        return np.array([s[0] for s in states]), np.array([s[1] for s in states])

    def step(self, torque: np.ndarray) -> None:
        pybullet.setJointMotorControlArray(
            self.body, range(4), pybullet.TORQUE_CONTROL, forces=torque.tolist(), physicsClientId=self.client
        )
        pybullet.stepSimulation(physicsClientId=self.client)


@pytest.fixture
def bullet(tmp_path):
    made = BulletFinger(tmp_path / "finger.urdf")
    yield made
    pybullet.disconnect(made.client)


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


@pytest.mark.parametrize("sign", ["physical", "printed"])
def test_without_contact_bullet_moves_as_the_free_simulation(bullet, sign) -> None:
    plant = Plant([finger()], DT)
    constants = DrivetrainConstants(sign=sign, reflected_inertia=(1.5e-3, 2e-3, 3e-3))
    memory = prepared(plant, constants)
    free, torque = memory.copy(), np.zeros(4)
    for i in range(750):
        command = START + 0.4 * np.sin(np.array([6.0, 5.0, 7.0]) * i * DT)
        plant.view(memory, "goal")[:] = command
        plant.kernel.control_step(0, *bullet.state(), torque, memory)
        bullet.step(torque)
        plant.kernel.step(command, free)
        for row in (MOTOR_POSITION, TORQUE):
            np.testing.assert_allclose(plant.signal(memory, row), plant.signal(free, row), atol=1e-9)
    assert np.max(np.abs(plant.view(memory, "contact"))) < 1e-9


def test_a_force_on_the_fingertip_is_felt_with_the_inertia_of_the_rotors(bullet) -> None:
    """Against the free simulation with the force's exact joint torques; the estimate is one step late."""
    plant = Plant([finger()], DT)
    memory = prepared(plant, DrivetrainConstants())
    free, torque = memory.copy(), np.zeros(4)
    force, coupling = [0.0, 0.6, 0.3], finger().coupling
    for i in range(500):
        q, v = bullet.state()
        plant.kernel.control_step(0, q, v, torque, memory)
        tip = pybullet.getLinkState(bullet.body, 3, computeForwardKinematics=True, physicsClientId=bullet.client)[0]
        if i > 50:
            pybullet.applyExternalForce(bullet.body, 3, force, tip, pybullet.WORLD_FRAME, physicsClientId=bullet.client)
        load = coupling.T @ joint_load(q, force) * (i > 50)
        plant.view(free, "external_torque")[:] = load
        bullet.step(torque)
        plant.kernel.step(START, free)
    q, _ = bullet.state()
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
