"""Every text of a widget is a literal of ours or comes out of `workbench/text.py`."""

import ast
from pathlib import Path

import pytest

import tactile_cube

WORKBENCH = Path(tactile_cube.__file__).parent / "workbench"
SHOWN = {"text", "title", "label", "labels", "options", "axis_label", "x_axis_label", "y_axis_label", "legend_label",
         "legend_group", "tooltips", "tooltip", "description", "placeholder"}  # fmt: skip
"""Properties of Bokeh's models by which a browser gets text."""
MADE = {"plain", "html", "listed"}


def ours(value: ast.expr) -> bool:
    """Whether a value is made of literals, constants of a module, numbers, and what text.py gives."""
    match value:
        case ast.Constant():
            return True
        case ast.Name(id=name):
            return name.isupper()
        case ast.JoinedStr(values=parts) | ast.List(elts=parts) | ast.Tuple(elts=parts):
            return all(map(ours, parts))
        case ast.FormattedValue(value=inner, format_spec=spec):
            return ours(inner) or (spec is not None and ast.unparse(spec)[-2] in "defg%")  # no text has such a format
        case ast.IfExp(body=one, orelse=other) | ast.BinOp(left=one, right=other):
            return ours(one) and ours(other)
        case ast.ListComp(elt=inner) | ast.Starred(value=inner):
            return ours(inner)
        case ast.Call(func=ast.Name(id="map"), args=[ast.Name(id=name), _]) | ast.Call(func=ast.Name(id=name)):
            return name in MADE  # by whom each part, or the whole, is made
    return False


def raw(tree: ast.AST) -> list[str]:
    """Where text goes into a widget past text.py, as LINE: CODE."""
    found: list[ast.AST] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            named = {word.arg: word.value for word in node.keywords}
            found += [value for name, value in named.items() if name in SHOWN and not ours(value)]
            called = ast.unparse(node.func).rpartition(".")[2]
            if called == "Div" and not ("disable_math" in named and ast.unparse(named["disable_math"]) == "True"):
                found.append(node)  # which would render TeX
            if called in ("Html", "Markup") and not all(isinstance(one, ast.Constant) for one in node.args):
                found.append(node)
        elif isinstance(node, ast.Assign):
            for target in node.targets:
                both = (target, node.value)
                several = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
                pairs = zip(*(one.elts for one in both), strict=True) if several else [both]  # type: ignore[attr-defined]
                found += [v for t, v in pairs if isinstance(t, ast.Attribute) and t.attr in SHOWN and not ours(v)]
    return [f"{one.lineno}: {ast.unparse(one)}" for one in found]  # type: ignore[attr-defined]


def test_no_module_gives_a_widget_text_but_by_the_one_way() -> None:
    modules = [file for file in WORKBENCH.rglob("*.py") if file.name != "text.py"]
    assert len(modules) > 8
    found = {file.name: raw(ast.parse(file.read_text(encoding="utf-8"))) for file in modules}
    assert {name: lines for name, lines in found.items() if lines} == {}


RAW = ("Select(title=joint)", "pane.text = name", "Button(label=f'Add {effect}')", "a.title, b.c = joint, 1",
       "radio.labels = [name for name in names]", "Select(options=[NONE, *names])", "Select(options=map(str, names))",
       "slider.update(title='a' + name)", "figure(x_axis_label=joint)", "Html(f'<b>{name}</b>')", "Html(name)",
       "Div(text=html(name))", "f.line(x, y, legend_label=joint if joint else 'a')",
       "Slider(title=f'{name:>9s}')")  # fmt: skip


@pytest.mark.parametrize("line", RAW)
def test_raw_text_is_found(line: str) -> None:
    assert len(raw(ast.parse(line))) == 1
