"""What `--help` prints, read from the files of the commands and of the configuration without importing anything."""

import ast
import os
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
    """What `--help` prints: the commands, and the groups and keys of this one."""
    lines = [f"python -m tactile_cube.{name}: {commands().get(name, '')}", "", "Commands:"]
    width = max(map(len, commands()))
    lines += [f"  python -m tactile_cube.{other:<{width}} {summary}" for other, summary in commands().items()]
    path = CONFIG / f"{name}.yaml"
    if path.is_file():
        lines += ["", "Groups (choose with group=option):", *_group_lines(path)]
        lines += ["", "Keys (set with key=value):", *_key_lines(path)]
    lines += [
        "",
        "--cfg job shows the configuration; -m runs every combination of comma-separated values; "
        "--hydra-help shows Hydra's own options.",
    ]
    return "\n".join(lines)


def commands() -> dict[str, str]:
    """Commands of the package and the first line of what they say about themselves, without importing them."""
    result = {}
    package = Path(__file__).parent
    modules = {path.stem: path for path in package.glob("*.py")}
    modules |= {path.parent.name: path for path in package.glob("*/__init__.py")}
    for name, path in sorted(modules.items()):
        text = path.read_text()
        if f'@command("{name}"' in text:
            docstring = ast.get_docstring(ast.parse(text)) or ""
            result[name] = docstring.partition("\n")[0]
    return result


def _group_lines(path: Path) -> list[str]:
    lines, groups = [], _groups(path)
    for group, default in groups.items():
        files = sorted((CONFIG / group).glob("*.yaml"))
        for index, file in enumerate(files):
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
    text = " ".join(comment)
    return re.split(r"(?<=[.:;]) ", text)[0].rstrip(":;") if text else ""


def _groups(path: Path) -> dict[str, str | None]:
    groups: dict[str, str | None] = {}
    for entry in yaml.safe_load(path.read_text()).get("defaults", []):
        if isinstance(entry, dict) and "@" not in next(iter(entry)):  # "@": not a choice of its own
            ((group, option),) = entry.items()
            name = group.removeprefix("override ").removeprefix("optional ").split("@")[0].strip("/ ")
            if (CONFIG / name).is_dir() and name != "hydra":
                groups[name] = option
    added = dict.fromkeys(ADDED) | {"experiment": RECIPE["train"]}
    return groups | (added if path.stem == "train" else {})


def _key_lines(path: Path) -> list[str]:
    """Top-level keys of a command's file with the comments behind them, as written there."""
    lines = path.read_text().splitlines()
    inside = False
    kept = []
    for line in lines:
        if line.startswith("defaults:"):
            inside = True
        elif inside and (not line or line[0] not in " #-"):
            inside = False
        if not inside and line and line[0] not in " #":
            kept.append(f"  {line}")
    return kept


SCRIPT = r"""
_tactile_cube_complete() {
    local words=($COMP_LINE) word=""
    [[ "$COMP_LINE" == *" " ]] || word="${words[-1]}"
    [[ "${words[1]}" == "-m" && "${words[2]}" == tactile_cube.* ]] || return
    local choices=$(COMP_LINE="$COMP_LINE" "${words[0]}" -m "${words[2]}" -sc query=bash 2> /dev/null)
    COMPREPLY=($(compgen -W "$choices" -- "$word"))
}
COMP_WORDBREAKS=${COMP_WORDBREAKS//=}
complete -o nospace -o default -F _tactile_cube_complete python python3
"""


def install_script(arguments: list[str]) -> str | None:
    """What `-sc install=bash` prints, or None if the arguments ask for something else."""
    asked = len(arguments) == 2 and arguments[0] in ("-sc", "--shell-completion") and arguments[1] == "install=bash"
    return SCRIPT if asked else None


def prepare_query() -> None:
    """Make the line to complete look to Hydra as if the command were an executable."""
    line = os.environ.get("COMP_LINE")
    if line:
        os.environ["COMP_LINE"] = re.sub(r"^\S+ -m (tactile_cube\.\w+)", r"\1", line)
