"""No import error hides: commands load, and what functions import when they are called is there."""

import ast
import functools
import subprocess
import sys
from pathlib import Path

import tactile_cube
from tactile_cube.command_help import commands

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"


def test_every_command_can_be_imported() -> None:
    # in a process of its own: a command's module takes the place of the package's function of that name
    imports = "".join(f"from tactile_cube.{name} import main\nassert callable(main)\n" for name in commands())
    done = subprocess.run([sys.executable, "-c", imports], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def imports_of_the_package(text: str) -> set[tuple[str, str]]:
    """Module and name of every `from tactile_cube... import ...`, within functions too."""
    found = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom) and node.module]
    package = [node for node in found if str(node.module).partition(".")[0] == "tactile_cube"]
    return {(str(node.module), alias.name) for node in package for alias in node.names}


def file_of(module: str) -> Path | None:
    """Where a module of the package stands, read and not run: importing all of them takes a while."""
    path = SOURCE.joinpath(*module.split("."))
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


@functools.cache
def names_in(file: Path) -> set[str]:
    """What a module binds."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return names


def is_there(module: str, name: str) -> bool:
    """Whether a module of the package has a name, be it a module below it."""
    file = file_of(module)
    at_the_top = module == "tactile_cube" and name in tactile_cube.__all__
    return file is not None and (at_the_top or name in names_in(file) or file_of(f"{module}.{name}") is not None)


def test_whatever_package_and_benchmarks_import_from_the_package_is_there() -> None:
    wanted: dict[tuple[str, str], Path] = {}
    for file in sorted([*(SOURCE / "tactile_cube").rglob("*.py"), *(ROOT / "benchmarks").rglob("*.py")]):
        wanted |= dict.fromkeys(imports_of_the_package(file.read_text(encoding="utf-8")), file)
    assert ("tactile_cube.training.run", "POLICY") in wanted
    missing = [f"{wanted[one].relative_to(ROOT)}: {one[0]}.{one[1]}" for one in sorted(wanted) if not is_there(*one)]
    assert missing == []


def test_an_import_that_leads_nowhere_is_found() -> None:
    text = "def f():\n    from tactile_cube.errors import InputError, Gone\n    from tactile_cube.away import x\n"
    assert {one for one in imports_of_the_package(text) if not is_there(*one)} == {
        ("tactile_cube.errors", "Gone"),
        ("tactile_cube.away", "x"),
    }
