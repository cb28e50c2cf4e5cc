"""What a mistyped name may have meant: a command, an option, a key, a policy, an effect or a joint."""

import difflib
import re
from collections.abc import Iterable, Iterator
from typing import Any

import yaml

from tactile_cube.command_help import CONFIG

SHORTEST = 5  # letters of the beginning of a name that tell it


def suggestion(word: str, known: Iterable[str], prefix: str = "") -> str:
    """Return the end of an error message: "; did you mean ...?", or nothing if no known name is near.

    Args:
        word: as the user wrote it.
        known: names that there are.
        prefix: what the user has to write before the name.

    Example:
        >>> suggestion("evalute", ["evaluate", "export"])
        '; did you mean evaluate?'
    """
    names = [*known]
    beginnings = {name[: len(word) + 1]: name for name in reversed(names) if len(word) >= SHORTEST}
    near = difflib.get_close_matches(word, names, 1, 0.75) or [name for name in names if word and word in name]
    near = near or [beginnings[one] for one in difflib.get_close_matches(word, beginnings, 1, 0.75)]
    return f"; did you mean {prefix}{near[0]}?" if near else ""


def meaning(key: str) -> str:
    """Return what the configuration says in brackets of a key that must be set, or nothing."""
    line = re.compile(rf"^ *{re.escape(key.rpartition('.')[2])}: \?\?\? *# *(.*)$", re.MULTILINE)
    files = sorted(CONFIG.rglob("*.yaml"), key=lambda path: len(path.parts))
    found = next((match for file in files if (match := line.search(file.read_text(encoding="utf-8")))), None)
    return f" ({found[1]})" if found else ""


def near_key(name: str) -> str:
    """Return the suggestion for a key of the configuration that does not exist, e.g. `agent.gama`."""
    keys = sorted(_keys())
    if name in keys:  # another command may have that very key
        return ""
    last = name.rpartition(".")[2]
    same_name = [known for known in keys if known.rpartition(".")[2] == last]
    near = difflib.get_close_matches(name, keys, 1, 0.75) or difflib.get_close_matches(name, same_name, 1, 0.0)
    return suggestion(near[0], near) if near else ""


def _keys() -> set[str]:
    """Dotted keys and groups of the configuration, as far as its files name them."""
    keys = {folder.name for folder in CONFIG.iterdir() if folder.is_dir()}
    for path in CONFIG.rglob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        groups = () if "@package _global_" in text else path.relative_to(CONFIG).parent.parts
        keys.update(_dotted(yaml.safe_load(text), ".".join(groups)))
    return keys


def _dotted(value: Any, prefix: str) -> Iterator[str]:
    if prefix:
        yield prefix
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ("defaults", "_target_", "hydra"):
                yield from _dotted(inner, f"{prefix}.{key}" if prefix else str(key))
