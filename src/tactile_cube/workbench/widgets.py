"""Widgets of a window: rows, texts, fields, selects, buttons."""

from collections.abc import Callable
from typing import Any

from bokeh.models import Button, Column, Div, LayoutDOM, Row, Select, TextInput

from tactile_cube.workbench.text import plain, show

NONE = "-"
YELLOW, RED = "background:#fff4ce;padding:4px 8px", "background:#ffe3dc;padding:4px 8px;border-left:5px solid #d55e00"


def row_of(*parts: LayoutDOM, **more: Any) -> Row:
    """Place widgets beside each other, in as many lines as the window needs."""
    return Row(*parts, sizing_mode="stretch_width", styles={"flex-wrap": "wrap"}, **more)


def column_of(*parts: LayoutDOM, **more: Any) -> Column:
    """Place widgets below each other, as wide as the window allows."""
    return Column(*parts, sizing_mode="stretch_width", **more)


def text_of(*parts: str, styles: dict[str, str] | None = None, **more: Any) -> Div:
    """Make a text as wide as the window allows."""
    wrapped = {"overflow-wrap": "anywhere"} | (styles or {})
    pane = Div(disable_math=True, styles=wrapped, **{"sizing_mode": "stretch_width"} | more)
    show(pane, *parts)
    return pane


def field(title: str, width: int = 170, **more: Any) -> TextInput:
    """Make a text field."""
    return TextInput(title=plain(title), width=width, **more)


def select(title: str, *values: str, width: int = 190) -> Select:
    """Make a select of values, with the first of them chosen."""
    return Select(title=plain(title), options=[*map(plain, values)], value=values[0] if values else "", width=width)


def button(label: str, work: Callable[[], object], kind: str = "default", **more: Any) -> Button:
    """Make a button that runs `work`."""
    made = Button(label=plain(label), button_type=kind, **{"width": 150, "align": "end"} | more)
    made.on_click(lambda: work())
    return made
