"""The one decorator that turns scalar Python into machine code, and gives it back with its types."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Numba's nopython compilation: IEEE arithmetic (no fast-math, so results are reproducible bit for bit), no GIL."""
    return cast(Function, numba.njit(error_model="numpy", nogil=True)(function))


def compiled_once(function: Function) -> Function:
    """As `compiled`, kept on disk for the next process; only for functions that call nothing outside their file."""
    return cast(Function, numba.njit(error_model="numpy", nogil=True, cache=True)(function))
