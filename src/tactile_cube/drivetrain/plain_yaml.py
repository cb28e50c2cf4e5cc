"""YAML as plain data: numbers, text, lists and mappings; nothing in a file can be executed or instantiated."""

from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from tactile_cube.errors import InputError

LARGEST = 1_000_000
"""Values in a file; aliases could make a few lines into more than any memory holds."""
Schema = TypeVar("Schema", bound=BaseModel)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in `path`.

    Raises:
        InputError: the file is missing, is no YAML, asks for an object (`!!python/...`) or holds no mapping.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        if _size(data, {}) >= LARGEST:
            raise ValueError(f"its aliases (*name) make more than {LARGEST} values of it")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text: {error}") from None
    except yaml.constructor.ConstructorError as error:
        raise InputError(f"{path}{_place(error)}: {error.problem}; only plain data is read, remove the tag") from None
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or " ".join(str(error).split())
        raise InputError(f"{path}{_place(error)}: not valid YAML: {problem}") from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, lists within lists within lists
        raise InputError(f"{path}: not usable YAML: {str(error).partition(';')[0]}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: expected a mapping of keys to values, received {type(data).__name__}")
    return data


def _size(value: Any, known: dict[int, int]) -> int:
    """Values within a value, those that aliases repeat each time; a value within itself counts as `LARGEST`."""
    if not isinstance(value, dict | list):
        return 1
    if id(value) not in known:
        known[id(value)] = LARGEST  # until it is known: within itself
        known[id(value)] = 1 + sum(
            _size(part, known) for part in (value.values() if isinstance(value, dict) else value)
        )
    return known[id(value)]


def read_schema(path: Path, schema: type[Schema]) -> Schema:
    """`path` checked against a pydantic schema; the error names the file, the key and the value received."""
    try:
        return schema.model_validate(read_yaml(path))
    except ValidationError as error:
        raise InputError(f"{path}: {describe(error)}") from None


def describe(error: ValidationError) -> str:
    """The first problem of a validation error in one line, and how many more there are."""
    first, more = error.errors()[0], error.error_count() - 1
    key = ".".join(str(part) for part in first["loc"]) or "the file"
    received = "" if first["type"] == "missing" else f", received {_short(first['input'])}"
    return f"key '{key}': {first['msg']}{received}" + (f" (and {more} more)" if more else "")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _place(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    return f", line {mark.line + 1}" if mark is not None else ""
