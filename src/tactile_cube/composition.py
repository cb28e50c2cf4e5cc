"""The configuration in conf/: its help texts, its composition, and suggestions for misspelt names.

Nothing is imported to answer `--help`.
"""

from __future__ import annotations

import ast
import difflib
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tactile_cube.errors import InputError

CONFIG = Path(__file__).parent / "conf"  # the configuration tree; in a checkout a link to conf/ at the top

ADDED = ("experiment", "without")
"""Groups of training without a default: `+experiment=option`, and `without=option` beside ablations."""

RECIPE = {"train": "curriculum"}  # the experiment that a command takes where the command line names none


def help_text(name: str) -> str:
    """Return the text of a command's `--help`: its groups and keys."""
    path = CONFIG / f"{name}.yaml"
    lines = [line for line in path.read_text().splitlines() if line and line[0] not in " #-"]
    keys = [f"  {line}" for line in lines if not line.startswith("defaults:")]
    return "\n".join(
        [
            f"python -m tactile_cube.{name}: {commands()[name]}",
            *("", "Groups (choose with group=option):", *_group_lines(path)),
            *("", "Keys (set with key=value):", *keys, ""),
            "--cfg job shows the configuration; -m runs every combination of comma-separated values; "
            "--hydra-help shows Hydra's own options; tactile-cube --help lists the other commands.",
        ]
    )


def commands() -> dict[str, str]:
    """Return command -> first line of its description, without importing the commands."""
    table = ast.parse((Path(__file__).parent / "commands.py").read_text(encoding="utf-8"))
    said = {part.name: ast.get_docstring(part) or "" for part in table.body if isinstance(part, ast.FunctionDef)}
    return {name: said[name].partition("\n")[0] for name in sorted(path.stem for path in CONFIG.glob("*.yaml"))}


def _group_lines(path: Path) -> list[str]:
    lines, groups = [], _groups(path)
    for group, default in groups.items():
        for index, file in enumerate(sorted((CONFIG / group).glob("*.yaml"))):
            mark = "*" if file.stem == default else " "
            head = f"{group}=" if index == 0 else ""
            lines.append(f"  {head:<16}{mark}{file.stem:<17} {_summary(file)}")
    if "without" not in groups:
        return [*lines, "  (* is the default)"]
    return [
        *lines,
        "  (* is the default, before what the experiment changes)",
        "  (+experiment=option changes several choices at once; to ablations: without=option)",
    ]


def _summary(file: Path) -> str:
    """Return the first sentence of the comment at the top of a configuration file."""
    comment = []
    for line in file.read_text().splitlines():
        if not line.startswith("#"):
            break
        if "@package" not in line:
            comment.append(line.lstrip("# ").strip())
    return re.split(r"(?<=[.:;]) ", " ".join(comment))[0].rstrip(":;")


def _groups(path: Path) -> dict[str, str | None]:
    groups: dict[str, str | None] = {}
    for entry in yaml.safe_load(path.read_text())["defaults"]:
        if isinstance(entry, dict) and "@" not in next(iter(entry)):  # "@": not a choice of its own
            ((group, option),) = entry.items()
            if (CONFIG / group).is_dir() and group != "hydra":
                groups[group] = option
    added = dict.fromkeys(ADDED) | {"experiment": RECIPE["train"]}
    return groups | (added if path.stem == "train" else {})


if TYPE_CHECKING:
    from omegaconf import DictConfig


def composed(name: str | None, settings: Sequence[str], with_hydra: bool = False) -> DictConfig:
    """Compose the configuration of a command with overrides, e.g. "task=table", "seed=1".

    A Hydra application that calls this keeps its own instance. Without a name, only what `settings` add is composed;
    `with_hydra` includes Hydra's own part, which names run folder and choices.

    Raises:
        hydra.errors.HydraException: a setting does not exist.
    """
    from hydra import compose, initialize_config_dir
    from hydra.core.global_hydra import GlobalHydra

    application = GlobalHydra.instance().hydra
    GlobalHydra.instance().hydra = None
    try:
        with initialize_config_dir(str(CONFIG.resolve()), version_base="1.3"):
            return compose(name, [*settings], return_hydra_config=with_hydra)
    finally:
        GlobalHydra.instance().hydra = application


def refuse_unknown_keys(name: str, config: DictConfig) -> None:
    """Refuse top-level keys that a command does not read: a mistyped `+experiment=` would start another run.

    Raises:
        InputError: a key that is none of the command's and no group of conf/.
    """
    own = yaml.safe_load((CONFIG / f"{name}.yaml").read_text(encoding="utf-8"))
    groups = [key for entry in own.get("defaults", []) if isinstance(entry, dict) for key in entry]
    placed = {key.partition("@")[2].partition(".")[0] for key in groups if "@" in key}
    known = {"hydra", *own, *placed}
    for key in map(str, config.keys() - known):
        if not (CONFIG / key).is_dir():
            raise InputError(f"{key}: no such setting of {name}; --help lists them{near_key(key)}")


def with_recipe(name: str, words: list[str]) -> list[str]:
    """Return a command line's words with the recipe in front of the first `key=value`, unless they choose one.

    Example:
        >>> with_recipe("train", ["train", "seed=1", "--cfg", "job"])
        ['train', '+experiment=curriculum', 'seed=1', '--cfg', 'job']
    """
    if name not in RECIPE or any(re.match(r"[+~]*experiment\b", word) for word in words):
        return words
    first = next((at for at, word in enumerate(words) if re.match(r"[+~]*[\w./@]+=", word)), len(words))
    return [*words[:first], f"+experiment={RECIPE[name]}", *words[first:]]


SHORTEST = 5  # letters from which on the beginning of a name identifies it


def suggestion(word: str, known: Iterable[str], prefix: str = "") -> str:
    """Return the end of an error message: "; did you mean ...?", or nothing if no known name is near.

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
    found = [match[1] for file in CONFIG.rglob("*.yaml") for match in line.finditer(file.read_text(encoding="utf-8"))]
    return f" ({min(found, key=len)})" if found else ""


def near_key(name: str) -> str:
    """Return the suggestion for a key of the configuration that does not exist, e.g. `agent.gama`."""
    found = {folder.name for folder in CONFIG.iterdir() if folder.is_dir()}
    for path in CONFIG.rglob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        groups = () if "@package _global_" in text else path.relative_to(CONFIG).parent.parts
        found.update(_dotted(yaml.safe_load(text), ".".join(groups)))
    keys = sorted(found)
    if name in keys:  # another command may have that very key
        return ""
    last = name.rpartition(".")[2]
    same_name = [known for known in keys if known.rpartition(".")[2] == last]
    near = difflib.get_close_matches(name, keys, 1, 0.75) or difflib.get_close_matches(name, same_name, 1, 0.0)
    return suggestion(near[0], near) if near else ""


def _dotted(value: Any, prefix: str) -> Iterator[str]:
    if prefix:
        yield prefix
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ("defaults", "_target_", "hydra"):
                yield from _dotted(inner, f"{prefix}.{key}" if prefix else str(key))
