import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.hand import DLR_HAND2, grasp_angles
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start, World, bullet_loop

needs_compiler = pytest.mark.skipif(bullet_loop.find_compiler() is None, reason="no C compiler here")


def episode(loop: type, trace: bool) -> list[np.ndarray]:
    world = World(options=SimulationOptions(trace=trace))
    assert isinstance(world._engine._loop, loop)  # type: ignore[attr-defined]
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
@pytest.mark.parametrize("trace", [False, True])
@pytest.mark.parametrize("compiler", [None, "/bin/false"])
def test_without_a_compiler_the_loop_in_python_gives_the_same_bits(
    trace: bool, compiler: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = episode(bullet_loop.NativeLoop, trace)
    monkeypatch.setattr(bullet_loop, "cache_directory", lambda: tmp_path)
    monkeypatch.setattr(bullet_loop, "find_compiler", lambda: compiler)
    monkeypatch.setattr(bullet_loop, "load_native", bullet_loop.native_library.__wrapped__)
    for one, other in zip(compiled, episode(bullet_loop.PythonLoop, trace), strict=True):
        np.testing.assert_array_equal(one, other)


@needs_compiler
def test_several_processes_may_compile_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bullet_loop, "cache_directory", lambda: tmp_path)
    with ThreadPoolExecutor(4) as pool:
        built = list(pool.map(lambda _: bullet_loop.native_library.__wrapped__(), range(4)))
    assert len(set(built)) == 1
    assert [file.name for file in tmp_path.iterdir()] == [built[0].name]


def test_importing_the_simulation_prints_nothing() -> None:
    code = "import tactile_cube.simulation, sys; print('end', file=sys.stderr)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert run.stderr == "end\n"
    assert run.stdout == ""
