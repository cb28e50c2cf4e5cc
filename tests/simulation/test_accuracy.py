from tactile_cube.simulation import SimulationOptions
from tactile_cube.simulation.accuracy import TWIST, measure_accuracy


def test_the_fast_preset_holds_and_twists_the_cube() -> None:
    result = measure_accuracy(SimulationOptions.fast())
    assert result.fault == ""
    assert result.creep < 5e-4
    assert result.coupling_error < 0.02
    assert TWIST * 1.15 < result.twist < TWIST * 0.5  # tips that spin on the faces let the cube go on a little
    assert (result.tip_forces > 0.3).all()
