"""Section: how long the workbench takes for what its user waits for; the browser's own part comes on top."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.speed.report import Figure, Section
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig

REFIT, CURVE = 2.0, 0.1  # [s] limits
JOINT, EFFECT = "q3", "stribeck_friction"
CONTROLLER = {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0}
NOMINAL = {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003}
MOVES = 100  # of a slider, for the memory


def workbench(
    rounds: int,
    duration: float = 12.0,
    moves: int = MOVES,
    kinds: Sequence[str] = ("ramps", "multisine", "policy", "holds"),
) -> Section:
    """A finger of three joints with a hidden Stribeck effect: refit with it, first look, slider to curve, memory.

    Args:
        rounds: samples a figure.
        duration: of a trial [s].
        moves: of a slider, over which the memory is watched.
        kinds: of excitation.
    """
    section = Section("workbench", f"what a user of the workbench waits for; trials of {duration:g} s, three joints")
    try:
        import psutil

        from tactile_cube.workbench.charts import TimeChart
    except ModuleNotFoundError as error:
        section.missing.append(f"{error.name}: not installed (pip install 'tactile-cube[dev,workbench]')")
        return section
    from tactile_cube.workbench.state import Workbench

    source = SimulatedRig(
        controller=CONTROLLER,
        nominal=NOMINAL,
        hidden=[f"{EFFECT}@{JOINT}"],
        kinds=kinds,
        duration=duration,
        validation=False,
    )
    with tempfile.TemporaryDirectory() as folder:
        write_recording(Path(folder), source.recordings(0)[""])
        bench = Workbench(read_recording(folder))

    def add() -> None:
        bench.add(f"{EFFECT}@{JOINT}")

    add()
    bench.undo()
    refits = _timed(add, rounds, bench.undo)
    looks = _timed(lambda: bench.candidates(JOINT), min(rounds, 3))
    add()
    chart, trial = TimeChart(), bench.never_fitted[0]
    chart.show(bench.comparison(trial), bench.recording.joints.index(JOINT), None)
    one = bench.values(JOINT)[-1]

    def move(share: float = 0.3) -> None:
        value = one.unknown.low + share * (one.unknown.high - one.unknown.low)
        chart.move(bench.simulate(trial, one.unknown.put(bench.stage.model, value)).position)

    section.figures = [
        _spread(f"refit with one effect at one of three joints, limit {REFIT:g} s", refits, "s"),
        _spread("first look at the candidates of one joint", looks, "s"),
        _spread(f"slider to curve, limit {1e3 * CURVE:g} ms", [1e3 * t for t in _timed(move, 5 * rounds)], "ms"),
    ]
    process = psutil.Process()
    for turn in (1, 2):
        for k in range(moves):
            move(k / moves)
            bench.set_parameter(one.key, one.value * (1.0 + 0.001 * (k % 2)))
            bench.undo()
        name = f"memory after {turn * moves} moves of a slider, each set and undone"
        section.figures.append(_spread(name, [process.memory_info().rss / 2**20], "MiB"))
    return section


def _timed(call: Callable[[], object], rounds: int, after: Callable[[], object] = lambda: None) -> list[float]:
    """Seconds on the clock of each call, the first one not counted."""
    call()
    after()
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
        after()
    return times


def _spread(name: str, values: list[float], unit: str) -> Figure:
    low, median, high = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return Figure(name, median, low, high, unit)
