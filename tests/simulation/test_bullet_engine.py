import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, bullet_engine
from tactile_cube.simulation.native_library import find_compiler

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def episode(engine: str, kind: str, trace: bool) -> list[np.ndarray]:
    world = World(options=SimulationOptions(engine, loop=kind, trace=trace))  # type: ignore[arg-type]
    assert world.loop == kind
    constants = EpisodeConstants(force_mean=0.04, torque_mean=0.002, table_height=-0.04, filter_time=0.12)
    world.reset(constants, Start(DLR_HAND2.start_angles))
    target = grasp_angles(DLR_HAND2, [0.08] * 3, [0, 0, 0], [0, 0, 0.1, 1], -0.01)
    signals = []
    for _ in range(12):
        world.step(target)
        signals += [world.q, world.dq, world.q_m, world.torque, world.cube_position, world.cube_quaternion]
        signals += list(world.trace.values())
    world.close()
    return signals


@needs_compiler
@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
@pytest.mark.parametrize("trace", [False, True])
def test_compiled_and_python_loop_agree_to_the_bit(engine: str, trace: bool) -> None:
    for compiled, interpreted in zip(episode(engine, "c", trace), episode(engine, "python", trace), strict=True):
        np.testing.assert_array_equal(compiled, interpreted)


def test_auto_runs_without_a_compiler_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bullet_engine, "find_compiler", lambda: None)
    world = World(options=SimulationOptions(loop="auto"))
    assert world.loop == "python"
    world.close()


def test_an_unknown_loop_is_refused() -> None:
    with pytest.raises(InputError, match=r"simulation\.loop is 'rust'; choose one of auto, c, python"):
        SimulationOptions(loop="rust")  # type: ignore[arg-type]
