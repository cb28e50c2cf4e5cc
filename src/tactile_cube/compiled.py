"""Scalar Python into machine code: the decorator that the physics uses, with its types kept."""

from collections.abc import Callable
from math import prod
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import intrinsic, overload

Array = npt.NDArray[np.float64]
Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile by Numba without Python objects: IEEE arithmetic (no fast-math: the same bits every time), no GIL."""
    return cast(Function, numba.njit(error_model="numpy", nogil=True)(function))


def compiled_once(function: Function) -> Function:
    """Compile as `compiled` and keep it on disk; only for functions that call nothing outside their file."""
    return cast(Function, numba.njit(error_model="numpy", nogil=True, cache=True)(function))


@intrinsic
def _as_pointer(context: Any, address: Any) -> Any:
    def build(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], target.get_value_type(signature.return_type))

    return types.CPointer(types.float64)(address), build  # type: ignore[no-untyped-call]


def borrowed(array: Array) -> Array:
    """Return the same flat float64 array without an owner: slicing it in compiled code then counts no references.

    Counting is atomic and costs more than the arithmetic of a small slice. The caller keeps the array alive.

    Raises:
        ValueError: its numbers do not lie side by side.
    """
    if array.strides[0] != array.itemsize:
        raise ValueError("an array with gaps: pass a contiguous one")
    return array


def shaped_view(array: Array, start: int, shape: tuple[int, ...]) -> Array:
    """Return the numbers from `start` on in another shape; numpy's reshape is an outside call in compiled code.

    In compiled code nothing is checked: the caller keeps the array alive, contiguous and long enough.
    """
    return array[start : start + prod(shape)].reshape(shape)


@overload(borrowed)
def _borrowed(array: Any) -> Any:
    def machine_code(array: Any) -> Any:
        if array.strides[0] != array.itemsize:
            raise ValueError("an array with gaps: pass a contiguous one")
        return numba.carray(_as_pointer(array.ctypes.data), array.shape)  # type: ignore

    return machine_code


@overload(shaped_view)
def _shaped_view(array: Any, start: Any, shape: Any) -> Any:
    def machine_code(array: Any, start: Any, shape: Any) -> Any:
        return numba.carray(_as_pointer(array.ctypes.data + start * array.itemsize), shape)  # type: ignore

    return machine_code
