"""What a mistyped name may have meant: a command, an option, a key, a policy, an effect or a joint."""

import difflib
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import yaml

_OPTION = re.compile(r"Could not find '(?P<group>[\w/]+)/(?P<option>[^'/]+)'")
_KEY = re.compile(r"Could not override '(?P<key>[^']+)'|^(?P<setting>[\w.]+): no such setting")


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
    near = difflib.get_close_matches(word, names, 1, 0.75) or [name for name in names if word and word in name]
    return f"; did you mean {prefix}{near[0]}?" if near else ""


def did_you_mean(message: str, tree: Path) -> str:
    """Return the suggestion for an error of the configuration.

    Args:
        message: of Hydra or of our settings.
        tree: folder of the configuration.

    Example:
        >>> did_you_mean("Could not override 'agent.gama'.", CONFIG)
        '; did you mean agent.gamma?'
    """
    if option := _OPTION.search(message):
        options = (path.stem for path in (tree / option["group"]).glob("*.yaml"))
        return suggestion(option["option"], options, f"{option['group']}=")
    key, keys = _KEY.search(message), _keys(tree)
    name = (key["key"] or key["setting"]) if key else ""
    if not name or name in keys:  # another command may have that very key
        return ""
    last = name.rpartition(".")[2]
    same_name = [known for known in sorted(keys) if known.rpartition(".")[2] == last]
    near = difflib.get_close_matches(name, sorted(keys), 1, 0.75) or difflib.get_close_matches(name, same_name, 1, 0.0)
    return suggestion(near[0], near) if near else ""


def _keys(tree: Path) -> set[str]:
    """Dotted keys and groups of the configuration, as far as its files name them."""
    keys = {str(folder.relative_to(tree)) for folder in tree.iterdir() if folder.is_dir()}
    for path in tree.rglob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        groups = () if "@package _global_" in text else path.relative_to(tree).parent.parts
        keys.update(_dotted(yaml.safe_load(text), ".".join(groups)))
    return keys


def _dotted(value: Any, prefix: str) -> Iterator[str]:
    if prefix:
        yield prefix
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ("defaults", "_target_", "hydra"):
                yield from _dotted(inner, f"{prefix}.{key}" if prefix else str(key))
