"""YAML as plain data: numbers, text, lists and mappings; nothing in a file can be executed or instantiated."""

import math
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.untrusted_file import read_text

DIGITS = 40  # of a number in a file
Schema = TypeVar("Schema", bound=BaseModel)


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """PyYAML's plain data, in which a key stands once and a number is one that a computer holds."""

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Refuse keys that stand twice, and `<<`, by which few lines make more than any memory holds."""
        known = set()
        for key, _ in node.value:
            if key.tag.endswith(":merge"):
                raise _at(key, "'<<' is not read; write the keys out")
            name = self.construct_object(key, deep=True)
            if isinstance(name, Hashable):
                if name in known:
                    raise _at(key, f"the key '{name}' stands twice; remove one")
                known.add(name)

    def number(self, node: yaml.ScalarNode) -> float:
        """Refuse 1e400, which would be infinite (`.inf` is), and numbers so long that reading them takes minutes."""
        if len(node.value) <= DIGITS:
            made = self.construct_yaml_int if node.tag.endswith(":int") else self.construct_yaml_float
            value: float = made(node)
            if math.isfinite(value) or node.value.lower().lstrip("+-") in (".inf", ".nan"):
                return value
        raise _at(node, f"{node.value[:DIGITS]} is larger than any number; write .inf if that is meant")


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.number)
_Loader.add_constructor("tag:yaml.org,2002:float", _Loader.number)
EXPONENT = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+$")
"""1e400 and 1e5 are numbers, as in YAML 1.2; by YAML 1.1 they are text."""
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", EXPONENT, [*"-+0123456789"])


def _at(node: yaml.Node, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read the mapping in `path`.

    Raises:
        InputError: the file is missing or too large, is no YAML, asks for an object (`!!python/...`), has a key twice
            or holds no mapping.
    """
    text = read_text(path)
    try:
        _require_shallow(text)
        data = yaml.load(text, _Loader)
        if _size(data, {}) >= limits.VALUES:
            raise ValueError(f"its aliases (*name) make more than {limits.VALUES} values of it")
    except yaml.constructor.ConstructorError as error:
        raise InputError(f"{path}{_place(error)}: {error.problem}; only plain data is read, remove the tag") from None
    except yaml.YAMLError as error:
        problem = getattr(error, "problem", None) or " ".join(str(error).split())
        raise InputError(f"{path}{_place(error)}: not valid YAML: {problem}") from None
    except ValueError as error:
        raise InputError(f"{path}: not usable YAML: {str(error).partition(';')[0]}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: expected a mapping of keys to values, received {type(data).__name__}")
    return data


def _require_shallow(text: str) -> None:
    """Refuse lists within lists within lists, and more values than `limits.VALUES`, before anything is made of them."""
    depth = 0
    for count, event in enumerate(yaml.parse(text, _Loader)):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if count > limits.VALUES or depth > limits.DEPTH:
            raise ValueError(f"more than {limits.VALUES} keys and values, or {limits.DEPTH} within each other")


def _size(value: Any, known: dict[int, int]) -> int:
    """Count the values within a value, aliases each time; a value within itself counts as `limits.VALUES`."""
    if not isinstance(value, dict | list):
        return 1
    if id(value) not in known:
        known[id(value)] = limits.VALUES  # until it is known: within itself
        known[id(value)] = 1 + sum(
            _size(part, known) for part in (value.values() if isinstance(value, dict) else value)
        )
    return known[id(value)]


def read_schema(path: Path, schema: type[Schema]) -> Schema:
    """Check `path` against a pydantic schema; the error names the file, the key and the value received."""
    try:
        return schema.model_validate(read_yaml(path))
    except ValidationError as error:
        raise InputError(f"{path}: {describe(error)}") from None


def describe(error: ValidationError) -> str:
    """Describe the first problem of a validation error in one line, with the number of further problems."""
    first, more = error.errors()[0], error.error_count() - 1
    key = ".".join(str(part) for part in first["loc"])
    value, message = repr(first["input"]), str(first["msg"]).removeprefix("Value error, ")
    received = f", received {value if len(value) <= 60 else f'{value[:57]}...'}" if first["type"] != "missing" else ""
    said = f"key '{key}': {message}{received}" if key else message
    return said + (f" (and {more} more)" if more else "")


def _place(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    return f", line {mark.line + 1}" if mark is not None else ""
