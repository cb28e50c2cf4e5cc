import platform
import sys

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, native_library
from tactile_cube.simulation import loop as loop_module
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
    monkeypatch.setattr(loop_module, "find_compiler", lambda: None)
    world = World(options=SimulationOptions(loop="auto"))
    assert world.loop == "python"
    world.close()


def test_an_unknown_loop_is_refused() -> None:
    with pytest.raises(InputError, match=r"simulation\.loop is 'rust'; choose one of auto, c, python"):
        SimulationOptions(loop="rust")  # type: ignore[arg-type]


needs_layout = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="known for this layout only"
)


@needs_compiler
@needs_layout
def test_the_compiled_loop_reads_where_bullet_writes_and_gives_the_same_bits_as_from_the_copy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ends = []
    for known in (True, False):
        if not known:
            monkeypatch.setattr(native_library.metadata, "version", lambda name: "3.2.8")
        world = World(options=SimulationOptions(loop="c"))
        found = world._engine._loop._who[1]  # type: ignore[attr-defined]
        assert bool(found) == known, "PyBullet's layout is not the known one: the loop is 6 % slower"
        world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
        for _ in range(5):
            world.step(DLR_HAND2.start_angles + 0.1)
        ends.append(np.concatenate([world.q, world.dq, world.cube_position]))
        world.close()
    np.testing.assert_array_equal(*ends)


@needs_compiler
@needs_layout
@pytest.mark.parametrize("wrong", [0x800310 + 8, 0x800310 - 4096, 1 << 40, 0x7FFF00000000, 0, -8])
def test_a_status_buffer_that_is_elsewhere_or_not_mapped_is_refused(wrong: int) -> None:
    world = World(options=SimulationOptions(loop="c"))
    world.reset(EpisodeConstants(), Start(DLR_HAND2.start_angles))
    engine = world._engine
    library, handle = engine._loop._library, engine._loop._handle  # type: ignore[attr-defined]
    finger = engine._scene.fingers[0]  # type: ignore[attr-defined]
    assert library.locate_status_buffer(handle, finger, native_library.status_offset())
    assert not library.locate_status_buffer(handle, finger, wrong)
    world.close()
