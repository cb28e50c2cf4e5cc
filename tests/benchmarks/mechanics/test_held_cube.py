from benchmarks.mechanics.held_cube import TWIST, measure_accuracy
from tactile_cube.simulation import SimulationOptions


def test_the_fast_preset_holds_and_twists_the_cube() -> None:
    result = measure_accuracy(SimulationOptions())
    assert result.fault == ""
    assert result.creep < 5e-4
    assert result.coupling_error < 0.02
    assert TWIST * 1.15 < result.twist < TWIST * 0.5  # tips that spin on the faces let the cube go on a little
    assert (result.tip_forces > 0.3).all()
