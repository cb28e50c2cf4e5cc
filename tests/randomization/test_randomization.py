import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.randomization import (
    Choice,
    Constant,
    Learnability,
    LogUniform,
    Randomization,
    Uniform,
    drawn_places,
    sample,
)
from tactile_cube.randomization.randomization import PARTS
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


MASS = Uniform(0.0, 0.8)


def taught(share: float = 1.0) -> Learnability:
    """Cubes below 0.2 kg are always kept, above 0.6 kg always lost, and between one of two."""
    known = Learnability({"cube_mass": MASS}, share)
    for number in range(4000):
        place = (number % 40) / 40
        known.add(np.array([[place]]), np.array([place >= 0.75 or (place >= 0.25 and number // 40 % 2 == 0)]))
    return known


def test_parts_are_drawn_by_p_times_1_minus_p() -> None:
    known = taught()
    p = known.lost[0]
    assert p == pytest.approx([0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1], abs=0.15)
    assert known.odds[0] == pytest.approx(p * (1 - p) / (p * (1 - p)).sum(), abs=1e-4)
    assert taught(0.6).odds[0] == pytest.approx(0.6 * known.odds[0] + 0.4 / PARTS)


def test_places_follow_the_odds_and_are_uniform_where_nothing_is_known() -> None:
    rng = np.random.default_rng(0)
    for known in (taught(), Learnability({"cube_mass": MASS}, 0.7)):
        places = np.array([drawn_places(known.odds, rng)[0] for _ in range(4000)])
        counts = np.bincount((places * PARTS).astype(int), minlength=PARTS) / len(places)
        assert counts == pytest.approx(known.odds[0], abs=0.03)


def test_a_place_says_where_in_its_range_a_value_lies_and_only_steered_ranges_have_one() -> None:
    values = {"cube_mass": MASS, "kp": Constant(3.0)}
    nominal, rng = EpisodeConstants(), np.random.default_rng(0)
    assert not Randomization(values=values).learnability(nominal).ranges
    steered = Randomization(values=values, steered=0.5)
    assert list(steered.learnability(nominal).ranges) == ["cube_mass"], "kp has a number for each joint"
    assert steered.constants(nominal, rng, {"cube_mass": 0.25}).cube_mass == pytest.approx(0.2)
    with pytest.raises(InputError, match=r"randomization\.steered is 1"):
        Randomization(steered=1.0)


def test_draws_have_the_distribution_they_are_named_after() -> None:
    rng = np.random.default_rng(0)
    uniform = sample(Uniform(2.0, 4.0), rng, (4000,))
    assert uniform.min() >= 2.0
    assert uniform.max() < 4.0
    assert uniform.mean() == pytest.approx(3.0, abs=0.05)
    logarithmic = np.log10(sample(LogUniform(2e-4, 2e-2), rng, (4000,)))
    assert logarithmic.mean() == pytest.approx(np.log10(2e-3), abs=0.03)
    chosen = sample(Choice((1.0, -1.0)), rng, (4000,))
    assert set(chosen.tolist()) == {1.0, -1.0}
    assert chosen.mean() == pytest.approx(0.0, abs=0.05)
    assert sample(Constant(7.0), rng, (3,)).tolist() == [7.0] * 3


@pytest.mark.parametrize("wrong", [lambda: Uniform(1.0, 0.0), lambda: LogUniform(0.0, 1.0), lambda: Choice(())])
def test_impossible_bounds_are_refused(wrong: type) -> None:
    with pytest.raises(InputError):
        wrong()
