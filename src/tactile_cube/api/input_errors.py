"""What a caller did wrong, as one kind of error."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from tactile_cube.cli import usage_error
from tactile_cube.errors import InputError

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def as_input_errors(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """The function with everything that the command line would tell in one line raised as an `InputError`.

    Hydra's own errors, those of pydantic and those wrapped in either say the same in many more lines.
    """

    @functools.wraps(function)
    def told(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        try:
            return function(*args, **kwargs)
        except Exception as error:
            message = usage_error(error)
            if message is None or (isinstance(error, InputError) and message == str(error)):
                raise
            raise InputError(message) from error

    return told
