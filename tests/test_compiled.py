import numpy as np
import pytest

from tactile_cube.compiled import borrowed


def test_a_borrowed_array_is_the_same_memory() -> None:
    array = np.arange(5.0)
    alias = borrowed(array)
    alias[2] = 7.0
    assert array[2] == 7.0


def test_an_array_with_gaps_cannot_be_borrowed() -> None:
    with pytest.raises(ValueError, match="contiguous"):
        borrowed(np.zeros(10)[::2])
