import numpy as np
import pytest

from tactile_cube.compiled import borrowed, shaped_view


def test_a_borrowed_array_is_the_same_memory() -> None:
    array = np.arange(5.0)
    alias = borrowed(array)
    alias[2] = 7.0
    assert array[2] == 7.0


def test_an_array_with_gaps_cannot_be_borrowed() -> None:
    with pytest.raises(ValueError, match="contiguous"):
        borrowed(np.zeros(10)[::2])


def test_a_shaped_view_is_the_same_memory_from_its_start_on() -> None:
    array = np.arange(10.0)
    view = shaped_view(array, 3, (2, 3))
    np.testing.assert_array_equal(view, [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]])
    view[1, 0] = -1.0
    assert array[6] == -1.0
