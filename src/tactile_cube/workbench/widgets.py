"""Widgets of a window: rows, texts, lists, buttons, and the form by which logs are imported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.models import Button, Column, Div, LayoutDOM, Row, Select, TextInput

from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.sources.units import ANGLE_UNITS, TIME_UNITS, TORQUE_UNITS
from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.text import Html, choose, html, listed, plain, show

GAINS = {"kp": "K_P [N m/rad]", "kd": "K_D [N m s/rad]", "torque_limit": "torque limit [N m]"}
NOMINAL = {
    "stiffness": "stiffness, if known",
    "static_friction": "friction [N m]",
    "reflected_inertia": "rotor inertia [kg m^2]",
}
UNITS = {"time": TIME_UNITS, "angle": ANGLE_UNITS, "torque": TORQUE_UNITS}
AUTO, NONE = "by name and values", "-"
TOGETHER, ALONE = "together with these", "left out"
YELLOW, RED = "background:#fff4ce;padding:4px 8px", "background:#ffe3dc;padding:4px 8px;border-left:5px solid #d55e00"


def row_of(*parts: LayoutDOM, **more: Any) -> Row:
    """Widgets beside each other, in as many lines as the window needs."""
    return Row(*parts, sizing_mode="stretch_width", styles={"flex-wrap": "wrap"}, **more)


def column_of(*parts: LayoutDOM, **more: Any) -> Column:
    """Widgets below each other, as wide as the window allows."""
    return Column(*parts, sizing_mode="stretch_width", **more)


def text_of(*parts: str, styles: dict[str, str] | None = None, **more: Any) -> Div:
    """A text as wide as the window allows."""
    wrapped = {"overflow-wrap": "anywhere"} | (styles or {})
    pane = Div(sizing_mode="stretch_width", disable_math=True, styles=wrapped, **more)
    show(pane, *parts)
    return pane


def button(label: str, work: Callable[[], object], kind: str = "default") -> Button:
    """A button that does something."""
    made = Button(label=plain(label), button_type=kind, width=150, align="end")
    made.on_click(lambda: work())
    return made


class ImportForm:
    """What waits to be imported, its first rows, which column is what, and what is known of the rig."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.waiting, self.columns = text_of(), column_of()
        self.table = text_of(styles={"overflow-x": "auto"})
        self.seen: tuple[list[str], list[str]] | None = None  # columns and joints: as long as they stay, choices do
        self.gains = {name: TextInput(title=plain(title), width=150) for name, title in GAINS.items()}
        self.nominal = {name: TextInput(title=plain(title), width=150) for name, title in NOMINAL.items()}
        self.mode = Select(title="commands are", options=["position", "torque"], value="position", width=110)
        self.length = TextInput(title="cut into trials of [s]", width=150)
        self.units = {
            f"{name}_unit": Select(title=plain(f"{name} in"), options=[AUTO, *map(plain, units)], value=AUTO, width=150)
            for name, units in UNITS.items()
        }
        self.before = Select(title="trials of this recording", options=[TOGETHER, ALONE], value=TOGETHER, width=200)
        words = (*self.gains.values(), self.mode, *self.nominal.values(), self.length, *self.units.values())
        buttons = row_of(button("Import", self._import, "primary"), self.before)
        self.whole = column_of(
            self.waiting, self.table, self.columns, row_of(*words), buttons, name="importing", visible=False
        )

    def show(self) -> None:
        """Show what waits."""
        desk, seen = self.desk, self.desk.preview
        self.whole.visible = bool(desk.logs) or (desk.urdf is not None and desk.bench is None)
        self.before.visible = desk.same_rig is not None
        names = [path.name for path in desk.logs]
        lacks = [what for what, there in (("a log", names), ("the URDF of the rig", desk.urdf)) if not there]
        text = f"To be imported: {', '.join(names)} with {desk.urdf.name if desk.urdf else '?'}"
        if desk.same_rig is not None:
            text += "; together with the trials of this recording, its gains hold where you state none"
        show(self.waiting, listed([text]), listed([f"still needed: {' and '.join(lacks)}"] if lacks else [], YELLOW))
        there = None if seen is None else (seen.columns, seen.joints)
        if there == self.seen:
            return
        self.seen = there
        show(self.table)
        self.columns.children = []
        if seen is None:
            return
        rows = [html(*(Html("<td>{:.6g}</td>").format(value) for value in row)) for row in seen.rows]
        head = html(*(Html("<th>{}</th>").format(name) for name in seen.columns))
        doubt = listed([seen.doubt] if seen.doubt else [], YELLOW)
        lines = html(*(Html("<tr>{}</tr>").format(row) for row in (head, *rows)))
        show(self.table, doubt, Html('<table cellpadding="4">{}</table>').format(lines))
        guessed = {joint: seen.guess.joints.get(joint, {}) if seen.guess else {} for joint in seen.joints}
        self.columns.children = [
            _columns_row("", "time", {"time": (seen.guess.time if seen.guess else None) or NONE}, seen.columns),
            *(
                _columns_row(joint, joint, {signal: entry.get(signal, NONE) for signal in SIGNALS}, seen.columns)
                for joint, entry in guessed.items()
            ),
        ]

    def _import(self) -> None:
        units = {name: select.value for name, select in self.units.items() if select.value != AUTO}
        length = {"length": self.length.value} if self.length.value.strip() else {}
        columns: dict[str, Any] = {}
        for row in self.columns.children:
            entry = {select.title: select.value for select in row.children[1:] if select.value != NONE}
            if row.name == "time":
                columns |= entry
            elif entry:
                columns[row.name] = entry
        gains, nominal = (
            {name: text.value.strip() for name, text in texts.items() if text.value.strip()}
            for texts in (self.gains, self.nominal)
        )
        gains["mode"] = self.mode.value
        self.desk.import_waiting(gains, nominal, columns, units | length, self.before.value == TOGETHER)


def _columns_row(label: str, name: str, chosen: dict[str, str], columns: list[str]) -> Row:
    """A select of columns for each signal, with the column that is chosen."""
    selects = []
    for signal, value in chosen.items():
        selects.append(Select(title=plain(signal), width=140))
        choose(selects[-1], [NONE, *columns], value)
    name_of = Div(width=80, disable_math=True, styles={"overflow-wrap": "anywhere"})
    show(name_of, label)
    return row_of(name_of, *selects, name=name)
