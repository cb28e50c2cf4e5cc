import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.randomization import Constant, Randomization, Uniform
from tactile_cube.simulation import EpisodeConstants


def draw(randomization: Randomization, seed: int = 0) -> EpisodeConstants:
    return randomization.constants(EpisodeConstants(), np.random.default_rng(seed))


def test_values_replace_factors_multiply_and_shifts_add() -> None:
    constants = draw(
        Randomization(
            values={"kp": Constant(5.0)},
            factors={"kp": Constant(1.1), "kd": Constant(2.0)},
            shifts={"cube_mass": Constant(0.01)},
        )
    )
    assert np.asarray(constants.kp) == pytest.approx(np.full(12, 5.5))
    assert np.asarray(constants.kd) == pytest.approx(2.0 * np.asarray(EpisodeConstants().kd))
    assert constants.cube_mass == pytest.approx(0.06)


def test_joints_differ_but_a_cube_stays_a_cube() -> None:
    constants = draw(Randomization(factors={"kp": Uniform(0.5, 2.0)}, shifts={"cube_size": Uniform(-0.005, 0.005)}))
    assert len(set(np.asarray(constants.kp).tolist())) == 12
    assert len(set(np.asarray(constants.cube_size).tolist())) == 1


def test_the_generator_decides_the_draw() -> None:
    randomization = Randomization(factors={"kp": Uniform(0.5, 2.0)})
    assert np.array_equal(draw(randomization, 1).kp, draw(randomization, 1).kp)
    assert not np.array_equal(draw(randomization, 1).kp, draw(randomization, 2).kp)
    assert draw(randomization, 1).force_seed != draw(randomization, 2).force_seed


def test_without_randomization_the_nominal_constants_stay() -> None:
    constants, nominal = draw(Randomization()), EpisodeConstants()
    assert np.array_equal(constants.kp, nominal.kp)
    assert constants.cube_mass == nominal.cube_mass


def test_unknown_constant_is_refused_with_its_name() -> None:
    with pytest.raises(InputError, match=r"randomization\.factors\.stifness: no such constant; choose from"):
        Randomization(factors={"stifness": Constant(1.0)})


@pytest.mark.parametrize("wrong", [{"sensor_noise": -0.1}, {"sticky_probability": 1.0}])
def test_impossible_disturbances_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        Randomization(**wrong)
