"""Views of memory for compiled code, which do the same where nothing is compiled."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactile_cube.compiled import borrowed, compiled, shaped_view

BORROWED = [borrowed, compiled(lambda array: borrowed(array))]
SHAPED_VIEW = [shaped_view, compiled(lambda array, start, shape: shaped_view(array, start, shape))]


@pytest.mark.parametrize("view", BORROWED)
def test_a_borrowed_array_is_the_same_memory(view: Callable[..., Any]) -> None:
    array = np.arange(5.0)
    alias = view(array)
    alias[2] = 7.0
    assert array[2] == 7.0


@pytest.mark.parametrize("view", BORROWED)
def test_an_array_with_gaps_cannot_be_borrowed(view: Callable[..., Any]) -> None:
    with pytest.raises(ValueError, match="contiguous"):
        view(np.zeros(10)[::2])


@pytest.mark.parametrize("view", SHAPED_VIEW)
def test_a_shaped_view_is_the_same_memory_from_its_start_on(view: Callable[..., Any]) -> None:
    array = np.arange(10.0)
    part = view(array, 3, (2, 3))
    np.testing.assert_array_equal(part, [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]])
    part[1, 0] = -1.0
    assert array[6] == -1.0
