import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.bench import KINDS, excitation, safe_range
from tactile_cube.measurement.recordings.rig import RigJoint


@pytest.mark.parametrize("kind", list(KINDS))
def test_commands_stay_inside_and_use_the_range(kind: str) -> None:
    low, high = np.array([-0.2, 0.1]), np.array([0.3, 1.0])
    command = excitation(kind, low, high, 10.0, 200.0, np.random.default_rng(0))
    assert command.shape == (2000, 2)
    assert (command >= low - 1e-9).all()
    assert (command <= high + 1e-9).all()
    assert (np.ptp(command, axis=0) > 0.3 * (high - low)).all()


@pytest.mark.parametrize(("kind", "longest", "moving"), [("holds", 76, 0.3), ("steps", 11, 0.05)])
def test_holds_and_steps_rest_between_quick_moves(kind: str, longest: int, moving: float) -> None:
    command = excitation(kind, np.zeros(1), np.ones(1), 20.0, 500.0, np.random.default_rng(0))[:, 0]
    moves = np.abs(np.diff(command)) > 1e-12
    lengths = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], moves, [0]]))))[::2]
    assert len(lengths) >= 15
    assert lengths.max() <= longest
    assert np.mean(moves) < moving


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="'chirp' is no excitation"):
        excitation("chirp", np.zeros(1), np.ones(1), 1.0, 100.0, np.random.default_rng(0))


def test_a_joint_without_limits_gets_a_range() -> None:
    assert safe_range(RigJoint("wheel", -np.inf, np.inf, None), 0.5) == (-0.5, 0.5)
    assert safe_range(RigJoint("a", -0.2, 1.0, None), 0.5) == pytest.approx((0.1, 0.7))
