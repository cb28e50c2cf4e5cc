import numpy as np

from tactile_cube.hand import DLR_HAND2
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World


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


def test_without_the_option_there_is_no_trace() -> None:
    world = World()
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    world.step(DLR_HAND2.start_angles)
    assert world.trace == {}
    world.close()
