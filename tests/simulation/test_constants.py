import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, Start


def test_one_number_means_all_joints_and_all_edges() -> None:
    constants = EpisodeConstants(kp=4.0, cube_size=0.07)
    np.testing.assert_array_equal(constants.kp, np.full(12, 4.0))
    np.testing.assert_array_equal(constants.cube_size, np.full(3, 0.07))


def test_vectors_cannot_be_changed_in_place() -> None:
    with pytest.raises(ValueError, match="read-only"):
        EpisodeConstants().kp[0] = 1.0  # type: ignore[index]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("filter_time", -0.1, "filter_time is -0.1"),
        ("cube_mass", 0.0, "cube_mass is 0.0; choose a value above 0"),
        ("kd", -1.0, "kd is"),
        ("kp", [1.0, 2.0], r"kp has shape \(2,\); give one number or 12"),
        ("joint_offset", float("nan"), "joint_offset"),
        ("elasticity_sign", 0, "elasticity_sign is 0"),
        ("gravity_scale", float("nan"), "gravity_scale is nan"),
    ],
)
def test_a_value_without_physical_meaning_is_refused_by_name(name: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        EpisodeConstants(**{name: value})  # type: ignore[arg-type]


def test_a_start_normalises_its_quaternion_and_refuses_zero() -> None:
    start = Start(np.zeros(12), cube_quaternion=(0, 0, 0, 2))
    np.testing.assert_array_equal(start.cube_quaternion, [0, 0, 0, 1])
    with pytest.raises(InputError, match="cube_quaternion is zero"):
        Start(np.zeros(12), cube_quaternion=(0, 0, 0, 0))


def test_a_start_whose_vectors_have_different_joints_is_refused() -> None:
    with pytest.raises(InputError, match=r"start.velocities has shape \(3,\); give one number or 12"):
        Start(np.zeros(12), velocities=np.zeros(3))


@pytest.mark.parametrize(
    "wrong", [{"dt": 0.0}, {"dt": 0.1}, {"substeps": 0}, {"solver_iterations": -3}, {"dt": float("nan")}]
)
def test_impossible_options_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"simulation.{next(iter(wrong))} is"):
        SimulationOptions(**wrong)  # type: ignore[arg-type]


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(InputError, match=r"simulation\.engine is 'drake'; choose one of bullet, mujoco, mixed"):
        SimulationOptions("drake")  # type: ignore[arg-type]
