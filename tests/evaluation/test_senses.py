import numpy as np
import pytest

from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.evaluation.variant import NumbPolicy, Variant, numb_reading
from tactile_cube.transforms import EnvConfig


class Echo:
    """Acts as it observes."""

    def start(self, env: object, seed: int) -> None:
        pass

    def act(self, observation: np.ndarray, step: int) -> np.ndarray:
        return observation


def felt(numb: list[str]) -> np.ndarray:
    """Which numbers of a stack of two readings still follow the world, (2, 24)."""
    policy = NumbPolicy(Echo(), numb)  # type: ignore[arg-type]
    first, later = np.zeros(48, dtype=np.float32), np.ones(48, dtype=np.float32)
    assert np.array_equal(policy.act(first, 0), first)
    return policy.act(later, 1).reshape(2, 24)


def test_frozen_angles_leave_the_control_errors() -> None:
    np.testing.assert_array_equal(felt(["q_m"]), np.tile(np.arange(24) >= 12, (2, 1)))
    np.testing.assert_array_equal(felt(["e_q"]), np.tile(np.arange(24) < 12, (2, 1)))


def test_a_numb_finger_leaves_the_other_nine_joints() -> None:
    reading = felt(["middle"])[0]
    assert np.flatnonzero(reading == 0).tolist() == [3, 4, 5, 15, 16, 17]


def test_nothing_is_felt_without_any_sense() -> None:
    assert not felt(["q_m", "e_q"]).any()


def test_unknown_senses_are_refused() -> None:
    with pytest.raises(InputError, match=r"'nose'; choose from q_m, e_q, ring"):
        Variant(numb=("nose",)).apply(EnvConfig(Task("full")))
    assert not numb_reading(()).any()
