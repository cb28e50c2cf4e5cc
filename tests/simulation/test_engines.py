"""Both engines move the same hand: geometry, inertia and free motion agree."""

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import polars as pl
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.hand import DLR_HAND2, Hand, grasp_angles, tip_positions
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World

ENGINES = ("bullet", "mujoco")
NOWHERE, FLOATS = (0.0, 0.0, 9.0), 10**6
PLAIN = Path(__file__).parents[3] / "shared" / "recordings" / "finger_plain"


@pytest.fixture
def world() -> World:
    return World(options=SimulationOptions("mujoco", substeps=1))


def test_fingertips_of_mujoco_are_those_of_the_kinematics_to_a_nanometre(world: World) -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        q = rng.uniform(DLR_HAND2.lower, DLR_HAND2.upper)
        world.reset(EpisodeConstants(), Start(q, NOWHERE))
        model, data = world._engine._model, world._engine._data  # type: ignore[attr-defined]
        mujoco.mj_kinematics(model, data)
        ends = [0.0, 0.0, DLR_HAND2.fingers[0].chain.reach[2]]
        tips = [
            data.body(f"{f.name} distal").xpos + data.body(f"{f.name} distal").xmat.reshape(3, 3) @ ends
            for f in DLR_HAND2.fingers
        ]
        np.testing.assert_allclose(tips, tip_positions(DLR_HAND2, q), atol=1e-9)


def test_the_mass_matrix_of_mujoco_is_that_of_the_rigid_body_equations_with_rotors(world: World) -> None:
    tree, rng = RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0)), np.random.default_rng(3)
    rotor = rng.uniform(1e-3, 2e-3, 12)
    q = rng.uniform(DLR_HAND2.lower, DLR_HAND2.upper)
    world.reset(EpisodeConstants(reflected_inertia=rotor), Start(q, NOWHERE))
    model, data = world._engine._model, world._engine._data  # type: ignore[attr-defined]
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    for k in range(4):
        dofs, own = slice(4 * k, 4 * k + 4), slice(3 * k, 3 * k + 3)
        expected, _ = tree.equations(tree.expand(q[own]), np.zeros(4), np.zeros(3))
        expected[:3, :3] += np.diag(rotor[own])
        np.testing.assert_allclose(full[dofs, dofs], expected, atol=1e-12)


def swung(engine: str, dt: float) -> np.ndarray:
    """q_m (n, 12) of fingers that swing without touching anything."""
    options = SimulationOptions(engine, dt=dt, substeps=round(0.1 / dt))  # type: ignore[arg-type]
    world = World(options=options)
    world.reset(EpisodeConstants(filter_time=0.1, gravity_onset=FLOATS), Start(DLR_HAND2.start_angles, NOWHERE))
    rows = []
    for k in range(40):
        world.step(DLR_HAND2.start_angles + 0.1 * np.sin(0.9 * k + np.arange(12)))
        rows.append(world.q_m)
    world.close()
    return np.array(rows)


@pytest.mark.parametrize("dt", [2e-3, 5e-4])
def test_free_fingers_move_alike_in_both_engines(dt: float) -> None:
    bullet, other = (swung(engine, dt) for engine in ENGINES)
    assert np.ptp(bullet, axis=0).max() > 0.1
    assert np.abs(bullet - other).max() < 0.5e-3


OF_PLAIN = {
    "kd": (0.23595, 0.22932, 0.22615),
    "static_friction": (0.02432, 0.02429, 0.01524),
    "reflected_inertia": (0.00281, 0.00315, 0.00318),
}


@pytest.mark.skipif(not PLAIN.exists(), reason="the recordings are not beside the repository")
def test_mujoco_follows_a_measured_finger_to_a_milliradian(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four trials of finger_plain at once, one by each finger of a hand whose fingers are that finger."""
    rig = (PLAIN / "rig.urdf").read_text()
    monkeypatch.setattr(Hand, "finger_urdf", lambda hand, finger: rig)
    world = World(fingers_apart(), SimulationOptions("mujoco", dt=5e-4, substeps=4))
    known = {key: np.tile(values, 4) for key, values in OF_PLAIN.items()}
    constants = EpisodeConstants(filter_time=1e-9, gravity_onset=FLOATS, **known)
    paths = sorted((PLAIN / "trials").glob("*.parquet"))
    assert len(paths) == 12
    for first in range(0, len(paths), 4):
        command, measured, torque = columns(paths[first : first + 4])
        world.reset(constants, Start(measured[0] - torque[0] / 25.0, NOWHERE, target=command[0]))
        error = np.empty_like(measured)
        for k, row in enumerate(command):
            world.step(row)
            error[k] = world.q_m - measured[k]
        assert milliradians(error).max() < 1.0, paths[first : first + 4]
    world.close()


def milliradians(error: np.ndarray) -> np.ndarray:
    """Of each joint (joints,); the mean is the joint offset of the trial's initialisation."""
    return 1e3 * np.std(error, axis=0)


def fingers_apart() -> Hand:
    """Fingers in a row, too far from each other to meet, their bases upright."""
    fingers = tuple(
        dataclasses.replace(finger, position=np.array([1.0 * k, 0.0, 0.0]), rotation=np.eye(3))
        for k, finger in enumerate(DLR_HAND2.fingers)
    )
    return dataclasses.replace(DLR_HAND2, fingers=fingers, position=np.zeros(3), rotation=np.eye(3))


def columns(paths: list[Path]) -> list[np.ndarray]:
    """Command, position and torque of some trials side by side, (rows, 3 each)."""
    tables = [pl.read_parquet(path) for path in paths]
    rows = min(table.height for table in tables)
    parts = [[f"q{k}.{what}" for k in (1, 2, 3)] for what in ("command", "position", "torque")]
    return [
        np.concatenate([table.select(names).to_numpy().astype(float)[:rows] for table in tables], axis=1)
        for names in parts
    ]


@pytest.mark.parametrize("engine", ENGINES)
def test_normal_forces_are_those_of_the_contacts_by_finger_and_kind_of_link_to_the_bit(engine: str) -> None:
    world = World(options=SimulationOptions(engine))  # type: ignore[arg-type]
    hand = DLR_HAND2
    q = grasp_angles(hand, (0.08,) * 3, (0.0, 0.0, -0.01), (0.0, 0.0, 0.0, 1.0), clearance=-0.01)
    q[1::3] += 0.05
    world.reset(EpisodeConstants(table_height=-0.05, gravity_onset=0), Start(q, (0.0, 0.0, -0.01)))
    seen = np.zeros((2, 4))
    for step in range(40):
        world.step(q + 0.3 * np.sin(0.7 * step + np.arange(12)))
        expected = np.zeros((2, 4))
        names = [finger.name for finger in hand.fingers]
        for contact in world.contacts():
            if contact.other == "cube" and contact.finger in names:
                finger = names.index(contact.finger)
                expected[int(contact.link == hand.fingers[finger].links[-1]), finger] += contact.force
        assert np.array_equal(world.normal_forces(), expected)
        seen += expected
    assert (seen.sum(1) > 0.0).all(), "both tips and links have touched it"
    world.close()


def test_mujocos_state_of_the_cube_is_its_free_joint_in_the_world(world: World) -> None:
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9])
    spin = np.array([2.0, -1.0, 3.0])
    world.reset(
        EpisodeConstants(),
        Start(np.asarray(DLR_HAND2.start_angles), NOWHERE, turn.as_quat(), None, 0.0, (0.1, 0.2, 0.3), spin),
    )
    for _ in range(3):
        world.step(np.asarray(DLR_HAND2.start_angles))
        data = world._engine._data  # type: ignore[attr-defined]
        w, x, y, z = data.qpos[-4:]
        expected = [*data.qpos[-7:-4], x, y, z, w, *data.qvel[-6:-3]]
        expected += Rotation.from_quat([x, y, z, w]).apply(data.qvel[-3:]).tolist()
        np.testing.assert_allclose(world._engine.cube_state(), expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(world.cube_angular_velocity, spin, atol=1e-6)  # equal moments of inertia: it keeps it


def test_fingertips_of_all_fingers_at_once_are_those_of_each() -> None:
    q = np.random.default_rng(0).uniform(DLR_HAND2.lower, DLR_HAND2.upper)
    each = [DLR_HAND2.finger_tips(k, q[DLR_HAND2.of_finger(k)][None])[0] for k in range(4)]
    np.testing.assert_allclose(tip_positions(DLR_HAND2, q), each, rtol=0.0, atol=1e-12)
