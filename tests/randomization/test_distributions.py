import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.randomization import Choice, Constant, LogUniform, Uniform, sample


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


@pytest.mark.parametrize(
    "wrong",
    [lambda: Uniform(1.0, 0.0), lambda: LogUniform(0.0, 1.0), lambda: Choice(())],
)
def test_impossible_bounds_are_refused(wrong: type) -> None:
    with pytest.raises(InputError):
        wrong()
