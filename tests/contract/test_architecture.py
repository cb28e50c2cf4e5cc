"""Packages import only what stands above them in docs/architecture.md."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "tactile_cube"
LAYERS = re.findall(r"^\| `(\w+)` \|", (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8"), re.MULTILINE)


def imported_packages(file: Path) -> set[str]:
    """First names below tactile_cube that a file imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return {name.split(".")[1] for name in names if name.startswith("tactile_cube.")}


def test_the_page_names_every_package() -> None:
    packages = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    assert packages == set(LAYERS)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_package_imports_only_packages_above_it(layer: str) -> None:
    below = set(LAYERS[LAYERS.index(layer) + 1 :])
    commands = {"commands", *(path.stem for path in (SOURCE / "conf").glob("*.yaml"))} - set(LAYERS)
    for file in (SOURCE / layer).rglob("*.py"):
        wrong = imported_packages(file) & (below | commands)
        assert not wrong, f"{file.relative_to(ROOT)} imports {', '.join(sorted(wrong))}"


def imported_modules(file: Path) -> set[str]:
    """Modules of the package that a file takes names from, wherever in it."""
    found = [node for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, ast.ImportFrom)]
    return {f"{node.module}.{alias.name}" for node in found for alias in node.names} | {str(n.module) for n in found}


@pytest.mark.parametrize("layer", LAYERS)
def test_no_modules_of_a_package_import_each_other_in_a_circle(layer: str) -> None:
    files = {".".join(path.relative_to(SOURCE.parent).with_suffix("").parts): path for path in SOURCE.rglob("*.py")}
    own = {name: file for name, file in files.items() if layer in name.split(".")[1:2] and file.name != "__init__.py"}
    sorter = TopologicalSorter({name: imported_modules(file) & own.keys() for name, file in own.items()})
    assert {*sorter.static_order()} == own.keys()  # a CycleError names the circle


def test_an_import_within_a_function_counts_too(tmp_path: Path) -> None:
    file = tmp_path / "lazy.py"
    file.write_text(
        "def f():\n    from tactile_cube.training.loop import Learner\n    from tactile_cube import errors\n"
    )
    assert imported_packages(file) == {"training", "errors"}
