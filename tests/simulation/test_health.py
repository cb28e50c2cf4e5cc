import numpy as np
import pytest

from tactile_cube.simulation.health import find_fault

CALM, STILL = np.full((4, 4), 0.4), np.zeros((4, 4))
CUBE = np.array([0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0], dtype=float)


def changed(array: np.ndarray, index: object, value: float) -> np.ndarray:
    copy = array.copy()
    copy[index] = value  # type: ignore[index]
    return copy


def test_a_calm_state_has_no_fault() -> None:
    assert find_fault(CALM, STILL, CUBE, [-0.001, 0.002]) == ""


@pytest.mark.parametrize(
    ("state", "word"),
    [
        ((changed(CALM, (0, 0), np.nan), STILL, CUBE, []), "joint speed is not a number"),
        ((CALM, changed(STILL, (2, 1), np.nan), CUBE, []), "joint speed is not a number"),
        ((CALM, changed(STILL, (1, 2), -80.0), CUBE, []), "joint speed"),
        ((CALM, STILL, changed(CUBE, 8, 6.0), []), "cube speed"),
        ((CALM, STILL, changed(CUBE, 11, -200.0), []), "cube spin"),
        ((CALM, STILL, CUBE, [0.0, -0.01]), "overlap"),
        ((CALM, STILL, changed(CUBE, 5, np.inf), []), "cube speed is not a number"),
        ((changed(CALM, (1, 3), 0.9), STILL, CUBE, []), "tendon stretch"),
    ],
)
def test_what_cannot_be_is_named(state: tuple[np.ndarray, np.ndarray, np.ndarray, list[float]], word: str) -> None:
    assert word in find_fault(*state)
