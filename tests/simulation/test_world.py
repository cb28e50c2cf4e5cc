import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World
from tactile_cube.simulation.world import random_wrench
from tests.simulation.finger_dynamics import bias, mass_matrix

HAND = DLR_HAND2
NOWHERE = (0.0, 0.0, 3.0)


@pytest.fixture(scope="module", params=["bullet", "mujoco"])
def world(request: pytest.FixtureRequest) -> World:
    return World(options=SimulationOptions(request.param))


def squeeze(inner: float = 0.01) -> np.ndarray:
    return grasp_angles(HAND, [0.08] * 3, [0, 0, 0], [0, 0, 0, 1], -inner)


def run(world: World, constants: EpisodeConstants, start: Start, actions: list[np.ndarray]) -> np.ndarray:
    world.reset(constants, start)
    rows = [np.concatenate([world.q_m, world.cube_position])]
    for action in actions:
        world.step(action)
        rows.append(np.concatenate([world.q_m, world.torque, world.cube_position, world.cube_quaternion]))
    return np.concatenate(rows)


def random_episode(rng: np.random.Generator) -> tuple[EpisodeConstants, Start, list[np.ndarray]]:
    size = 0.08 + rng.choice([0.0, 0.003])
    quaternion = Rotation.from_euler("z", rng.uniform(-0.7, 0.7)).as_quat()
    table = -size / 2 if rng.random() < 0.5 else None
    constants = EpisodeConstants(cube_size=size, filter_time=0.12, table_height=table, tip_friction=rng.uniform(0.8, 1))
    start = Start(grasp_angles(HAND, [size] * 3, [0, 0, 0], quaternion), (0, 0, 0), quaternion)
    return constants, start, [start.angles + rng.uniform(-0.3, 0.3, 12) for _ in range(8)]


def test_an_episode_does_not_depend_on_what_the_world_did_before(world: World) -> None:
    rng = np.random.default_rng(3)
    episodes = [random_episode(rng) for _ in range(5)]
    fresh = []
    for episode in episodes:
        other = World(options=world.options)
        fresh.append(run(other, *episode))
        other.close()
    for k in (0, 3, 0, 4, 2, 1, 1):
        np.testing.assert_array_equal(run(world, *episodes[k]), fresh[k])


def test_an_eccentric_or_soft_grasp_leaves_no_trace_in_the_next_episode(world: World) -> None:
    constants, start, actions = random_episode(np.random.default_rng(3))
    before = run(world, constants, start, actions)
    other = dataclasses.replace(constants, cube_com=(0.01, 0.0, 0.0), tip_compliance=3e-4)
    changed = run(world, other, start, actions)
    assert not np.array_equal(before, changed)
    np.testing.assert_array_equal(run(world, constants, start, actions), before)
    np.testing.assert_array_equal(run(world, other, start, actions), changed)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_squeeze_of_10_mm_holds_the_cube_for_10_s_at_full_gravity(world: World, seed: int) -> None:
    rng = np.random.default_rng(seed)
    quaternion = Rotation.from_euler("xyz", rng.uniform([-0.01, -0.01, -0.1], [0.01, 0.01, 0.1])).as_quat()
    position = rng.uniform(-1, 1, 3) * [1e-3, 1e-3, 5e-3]
    constants = EpisodeConstants(cube_mass=rng.uniform(0.045, 0.055))
    world.reset(constants, Start(grasp_angles(HAND, [0.08] * 3, position, quaternion), position, quaternion))
    target = grasp_angles(HAND, [0.08] * 3, position, quaternion, -0.01)
    for k in range(100):
        world.step(target)
        if k == 49:
            halfway = world.cube_position.copy()
    assert world.healthy, world.fault
    assert np.linalg.norm(world.cube_position - halfway) < 5e-4
    assert sum(contact.other == "cube" for contact in world.contacts()) >= 4


def test_the_cube_floats_for_four_policy_steps_and_then_falls(world: World) -> None:
    world.reset(EpisodeConstants(), Start(HAND.start_angles, NOWHERE))
    heights = []
    for _ in range(6):
        world.step(HAND.start_angles)
        heights.append(world.cube_position[2] - NOWHERE[2])
    assert heights[3] == 0.0
    assert heights[5] == pytest.approx(-0.5 * 9.81 * 0.2**2, rel=0.02)


def test_a_share_of_gravity_acts_on_the_cube_but_not_on_the_fingers(world: World) -> None:
    sag = []
    for scale in (1.0, 0.05):
        constants = EpisodeConstants(gravity_scale=scale, gravity_onset=0, static_friction=0.0)
        world.reset(constants, Start(HAND.start_angles, NOWHERE))
        for _ in range(3):
            world.step(HAND.start_angles)
        sag.append(world.q - HAND.start_angles)
        assert world.cube_linear_velocity[2] == pytest.approx(-9.81 * scale * 0.3, rel=1e-6)
    assert np.abs(sag[0]).max() > 5e-3
    np.testing.assert_allclose(sag[1], sag[0], atol=1e-9)


def test_a_table_carries_the_cube(world: World) -> None:
    away = np.where(np.arange(12) % 3 == 1, -0.1, 0.0)
    world.reset(EpisodeConstants(table_height=-0.04), Start(away))
    for _ in range(20):
        world.step(away)
    assert np.abs(world.cube_position).max() < 1e-3
    on_table = [contact for contact in world.contacts() if contact.finger == "table"]
    assert sum(contact.force * contact.normal[2] for contact in on_table) == pytest.approx(0.05 * 9.81, rel=0.02)


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_accelerations_agree_with_the_lagrangian_of_a_finger(engine: str) -> None:
    world = World(options=SimulationOptions(engine, substeps=1))
    rng = np.random.default_rng(5)
    rotor = rng.uniform(1e-3, 2e-3, 12)
    tilt = (0.3, -0.2, -1.0)
    constants = EpisodeConstants(kd=0.0, static_friction=0.0, reflected_inertia=rotor, gravity_direction=tilt)
    down = 9.81 * np.array(tilt) / np.linalg.norm(tilt)
    for _ in range(4):
        q, v = HAND.start_angles + rng.uniform(-0.05, 0.05, 12), rng.uniform(-3, 3, 12)
        world.reset(constants, Start(q, NOWHERE, velocities=v))
        world.step(q + rng.uniform(-0.2, 0.2, 12))
        for k in range(4):
            own = slice(3 * k, 3 * k + 3)
            M = mass_matrix(HAND, q[own]) + np.diag(rotor[own])
            h = bias(HAND, q[own], v[own], HAND.base_in_world(k)[1].T @ down)
            expected = np.linalg.solve(M, world.torque[own] - h)
            measured = (world.dq[own] - v[own]) / world.options.dt
            assert np.linalg.norm(measured - expected) < 1e-3 * np.linalg.norm(expected)
    world.close()


def test_a_joint_offset_shifts_what_is_read_and_what_is_commanded_alike(world: World) -> None:
    offset = np.linspace(-0.05, 0.05, 12)
    runs = []
    for shift in (np.zeros(12), offset):
        world.reset(EpisodeConstants(joint_offset=shift), Start(HAND.start_angles))
        for _ in range(5):
            world.step(squeeze() + shift)
        runs.append((world.q, world.q_m - shift, world.q_f - shift))
    np.testing.assert_allclose(runs[1], runs[0], atol=1e-9)


def test_pushes_move_the_cube_by_force_and_torque(world: World) -> None:
    constants = EpisodeConstants(gravity_onset=1000)
    world.reset(constants, Start(HAND.start_angles, NOWHERE))
    world.push_cube(np.array([0.02, 0.0, -0.01]), np.array([0.0, 1e-4, 0.0]))
    for _ in range(5):
        world.step(HAND.start_angles)
    np.testing.assert_allclose(world.cube_linear_velocity, np.array([0.02, 0.0, -0.01]) / 0.05 * 0.5, rtol=1e-6)
    inertia = 0.05 / 6 * 0.08**2
    np.testing.assert_allclose(world.cube_angular_velocity[1], 1e-4 / inertia * 0.5, rtol=1e-3)


def test_a_pull_at_a_finger_moves_that_finger_the_way_of_the_force(world: World) -> None:
    world.reset(EpisodeConstants(static_friction=0.0), Start(HAND.start_angles, NOWHERE))
    before = world.tip_positions
    world.pull_finger(2, np.array([0.0, 1.0, 0.0]))
    for _ in range(5):
        world.step(HAND.start_angles)
    moved = world.tip_positions - before
    assert moved[2, 1] > 2e-3
    assert moved[2, 1] > 2 * np.abs(moved[[0, 1, 3]]).max()


def test_random_forces_come_from_their_seed(world: World) -> None:
    def final(seed: int) -> np.ndarray:
        constants = EpisodeConstants(force_mean=0.04, torque_mean=0.002, force_seed=seed, gravity_onset=1000)
        world.reset(constants, Start(HAND.start_angles, NOWHERE))
        for _ in range(8):
            world.step(HAND.start_angles)
        return world.cube_position.copy()

    np.testing.assert_array_equal(final(1), final(1))
    assert np.linalg.norm(final(1) - final(2)) > 1e-3


def test_damping_that_the_time_step_cannot_bear_is_refused_with_its_numbers(world: World) -> None:
    with pytest.raises(InputError, match=r"K_D dt eig_max.* must stay below 2"):
        world.reset(EpisodeConstants(kd=3.0, reflected_inertia=1e-3), Start(HAND.start_angles))


def test_a_cube_pushed_into_a_finger_is_reported_as_a_fault(world: World) -> None:
    world.reset(EpisodeConstants(), Start(HAND.start_angles, (0.01, 0.0, 0.0), cube_linear_velocity=(30.0, 0.0, 0.0)))
    world.step(HAND.start_angles)
    assert not world.healthy
    assert "above" in world.fault
    world.reset(EpisodeConstants(), Start(HAND.start_angles))
    assert world.healthy


FOLLOW_UP = EpisodeConstants(force_mean=0.04, force_std=0.008, torque_mean=0.002, torque_std=0.0004)


def test_without_sizes_there_is_no_random_push() -> None:
    assert random_wrench(EpisodeConstants(), 1.0) is None


def test_a_random_push_is_redrawn_every_half_second_and_constant_between() -> None:
    wrenches = [random_wrench(FOLLOW_UP, 0.1 * k) for k in range(11)]
    for k in range(1, 11):
        assert np.array_equal(wrenches[k], wrenches[k - 1]) == (k % 5 != 0)


def test_sizes_of_random_pushes_follow_the_given_distributions() -> None:
    drawn = np.array([random_wrench(FOLLOW_UP, 0.5 * k) for k in range(600)])
    force, torque = np.linalg.norm(drawn[:, :3], axis=1), np.linalg.norm(drawn[:, 3:], axis=1)
    assert abs(force.mean() - 0.04) < 0.001
    assert abs(force.std() - 0.008) < 0.001
    assert abs(torque.mean() - 0.002) < 5e-5
    assert abs(torque.std() - 0.0004) < 5e-5
    ways = np.hstack([drawn[:, :3] / force[:, None], drawn[:, 3:] / torque[:, None]])
    assert np.abs(ways.mean(axis=0)).max() < 0.07
    assert np.abs(np.corrcoef(ways.T) - np.eye(6)).max() < 0.15, "every way is as likely, those of the torque apart"


def test_the_trace_holds_every_physics_step_and_joins_up() -> None:
    world = World(options=SimulationOptions(trace=True))
    offset = np.linspace(-0.02, 0.02, 12)
    world.reset(EpisodeConstants(joint_offset=offset, filter_time=0.2), Start(DLR_HAND2.start_angles))
    pieces = []
    for _ in range(8):
        before = world.q, world.cube_position.copy()
        world.step(DLR_HAND2.start_angles + 0.1)
        pieces.append(world.trace)
        np.testing.assert_array_equal(world.trace["q"][0], before[0])
        np.testing.assert_array_equal(world.trace["cube_position"][0], before[1])
        for name, value in (("q_m", world.q_m), ("q_d", world.q_d), ("torque", world.torque)):
            np.testing.assert_array_equal(world.trace[name][-1], value)
        np.testing.assert_allclose(world.trace["q_f"][-1], world.q_f, atol=1e-12)
    time = np.concatenate([piece["time"] for piece in pieces])
    np.testing.assert_allclose(time, 0.002 * np.arange(400), atol=1e-12)
    velocity = np.concatenate([piece["dq"] for piece in pieces])
    position = np.concatenate([piece["q"] for piece in pieces])
    np.testing.assert_allclose(np.diff(position, axis=0), 0.002 * velocity[1:], atol=1e-12)
    world.close()
