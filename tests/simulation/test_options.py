import pytest

from tactile_cube.errors import InputError
from tactile_cube.simulation import SimulationOptions


def test_a_policy_step_of_the_presets_lasts_a_tenth_of_a_second() -> None:
    for options in (SimulationOptions(), SimulationOptions.faithful()):
        assert options.policy_dt == pytest.approx(0.1)


@pytest.mark.parametrize(
    "wrong", [{"dt": 0.0}, {"dt": 0.1}, {"substeps": 0}, {"solver_iterations": -3}, {"dt": float("nan")}]
)
def test_impossible_options_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"simulation.{next(iter(wrong))} is"):
        SimulationOptions(**wrong)  # type: ignore[arg-type]


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(InputError, match=r"simulation\.engine is 'drake'; choose one of bullet, mujoco, mixed"):
        SimulationOptions("drake")  # type: ignore[arg-type]
