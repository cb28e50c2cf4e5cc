"""What `--help` prints, read from the files of the commands and of the configuration without importing anything."""

import ast
import re
from pathlib import Path

import yaml

CONFIG = Path(__file__).parent / "conf"
"""The configuration tree; in a checkout a link to conf/ at the top."""

ADDED = ("experiment", "without")
"""Groups of training that no default chooses from: `+experiment=option`, and `without=option` beside ablations."""

RECIPE = {"train": "curriculum"}
"""The experiment that a command takes where the command line names none."""


def help_text(name: str) -> str:
    """What `--help` prints of a command: its groups and keys."""
    path = CONFIG / f"{name}.yaml"
    return "\n".join(
        [
            f"python -m tactile_cube.{name}: {commands()[name]}",
            *("", "Groups (choose with group=option):", *_group_lines(path)),
            *("", "Keys (set with key=value):", *_key_lines(path), ""),
            "--cfg job shows the configuration; -m runs every combination of comma-separated values; "
            "--hydra-help shows Hydra's own options; tactile-cube --help lists the other commands.",
        ]
    )


def commands() -> dict[str, str]:
    """Commands of the package and the first line of what they say about themselves, without importing them."""
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
    """The first sentence of the comment that a configuration file begins with."""
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


def _key_lines(path: Path) -> list[str]:
    lines = [line for line in path.read_text().splitlines() if line and line[0] not in " #-"]
    return [f"  {line}" for line in lines if not line.startswith("defaults:")]
