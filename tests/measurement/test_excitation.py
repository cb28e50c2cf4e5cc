import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.excitation import KINDS, excitation, safe_range
from tactile_cube.measurement.recordings.rig import RigJoint


@pytest.mark.parametrize("kind", list(KINDS))
def test_commands_stay_inside_and_use_the_range(kind: str) -> None:
    low, high = np.array([-0.2, 0.1]), np.array([0.3, 1.0])
    command = excitation(kind, low, high, 10.0, 200.0, np.random.default_rng(0))
    assert command.shape == (2000, 2)
    assert (command >= low - 1e-9).all()
    assert (command <= high + 1e-9).all()
    assert (np.ptp(command, axis=0) > 0.3 * (high - low)).all()


def test_the_same_seed_gives_the_same_commands() -> None:
    one, two = (excitation("policy", np.zeros(2), np.ones(2), 3.0, 100.0, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one, two)


def test_holds_stand_still_most_of_the_time() -> None:
    command = excitation("holds", np.zeros(1), np.ones(1), 20.0, 100.0, np.random.default_rng(0))
    assert np.mean(np.abs(np.diff(command[:, 0])) < 1e-12) > 0.7


def test_steps_are_over_within_hundredths_of_a_second() -> None:
    command = excitation("steps", np.zeros(1), np.ones(1), 20.0, 500.0, np.random.default_rng(0))[:, 0]
    moving = np.abs(np.diff(command)) > 1e-12
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving, [0]])))
    lengths = np.diff(edges)[::2]
    assert len(lengths) >= 20
    assert lengths.max() <= 11
    assert np.mean(moving) < 0.05


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="'chirp' is no excitation"):
        excitation("chirp", np.zeros(1), np.ones(1), 1.0, 100.0, np.random.default_rng(0))


def test_a_joint_without_limits_gets_a_range() -> None:
    assert safe_range(RigJoint("wheel", -np.inf, np.inf, None), 0.5) == (-0.5, 0.5)
    assert safe_range(RigJoint("a", -0.2, 1.0, None), 0.5) == pytest.approx((0.1, 0.7))
