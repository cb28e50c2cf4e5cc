from pathlib import Path

from benchmarks.size import sizes


def test_a_checkout_is_counted(tmp_path: Path) -> None:
    texts = {"src/a/b.py": "x\ny\n", "src/c.py": "", "tests/d.py": "x\n", "docs/results/e.md": "two words\n"}
    for name, text in (texts | {"docs/results/f.json": "[1]", "README.md": "one\n"}).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = sizes(tmp_path)
    found.pop("commands")
    assert [*found.values()] == [2, 2, 1, 0, 1, 2, 3]
