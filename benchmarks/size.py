"""How large the project is: `python -m benchmarks.size`."""

from collections.abc import Iterable
from pathlib import Path

from tactile_cube.composition import commands

ROOT = Path(__file__).parents[1]


def lines(files: Iterable[Path]) -> int:
    """Lines of text files."""
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)


def sizes(root: Path) -> dict[str, int]:
    """Return the sizes of a checkout, by kind."""
    package, pages = list((root / "src").rglob("*.py")), list((root / "docs").rglob("*.md"))
    results = [file for file in (root / "docs" / "results").rglob("*") if file.is_file() and file.suffix != ".md"]
    return {
        "lines of the package": lines(package),
        "files of the package": len(package),
        "lines of tests": lines((root / "tests").rglob("*.py")),
        "lines of benchmarks": lines((root / "benchmarks").rglob("*.py")),
        "commands": len(commands()),
        "lines of the README": lines([root / "README.md"]),
        "words of docs": sum(len(page.read_text(encoding="utf-8").split()) for page in pages),
        "bytes of data and pictures in docs/results": sum(file.stat().st_size for file in results),
    }


if __name__ == "__main__":
    for name, size in sizes(ROOT).items():
        print(f"{size:>9} {name}")
