"""The notebooks in examples/ run from top to bottom and come to what they show."""

import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def without_numbers(text: str) -> str:
    """A text in which every number reads #: the last digits are another processor's own."""
    return re.sub(r"\d[\d.]*", "#", text)


def run_cells(notebook: Path) -> dict[str, Any]:
    """The names that the code cells leave, run one after the other as a kernel does; each prints what is shown."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    names: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate(content["cells"]):
        if cell["cell_type"] == "code":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile("".join(cell["source"]), f"{notebook.name}[{number}]", "exec"), names)
            for shown in cell["outputs"]:
                assert without_numbers("".join(shown["text"])) == without_numbers(printed.getvalue())
    return names


def test_a_servo_from_arrays_gets_its_effect_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = EXAMPLES / "servo_from_arrays.ipynb"
    assert sum(bool(cell.get("outputs")) for cell in json.loads(notebook.read_text())["cells"]) == 3
    names = run_cells(notebook)
    assert names["found"].effects == ["torque_bias@q2"]
    assert names["after"].error < 0.5 * names["before"].error
    assert list(tmp_path.iterdir()) == []


def test_every_notebook_is_run_by_a_test() -> None:
    assert {path.name for path in EXAMPLES.glob("*.ipynb")} == {"servo_from_arrays.ipynb"}
