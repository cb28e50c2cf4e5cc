"""The form by which logs are imported: first rows, which column is what, and what is known of the rig."""

from __future__ import annotations

from typing import Any

from bokeh.models import Button, Div, Row, Select, SVGIcon, TextInput, Toggle

from tactile_cube.measurement.recordings.columns import SIGNALS
from tactile_cube.measurement.sources.column_map import NEEDED
from tactile_cube.measurement.sources.lever import ROBOTS
from tactile_cube.measurement.sources.mechanism import servos
from tactile_cube.measurement.sources.units import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    RANGE,
    TIME_UNITS,
    TORQUE_UNITS,
    USUAL_TICKS,
)
from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.importing import Preview
from tactile_cube.workbench.text import Html, choose, html, listed, plain, show
from tactile_cube.workbench.widgets import NONE, YELLOW, button, column_of, row_of, text_of

AUTO, BEFORE = "by name, values", "before its command"
TOGETHER, ALONE = "together with these", "left out"
MODE, READ = "controller.mode", "read"
ONE_JOINT = {"mass": "its mass [kg], if known", "lever": "its lever [m], if known"}
CONTROLLER = {
    "controller.kp": "K_P [N m/rad]", "controller.kd": "K_D [N m s/rad]",
    "controller.torque_limit": "torque limit [N m]", "controller.kt": "kt [N m/A]", "controller.R": "R [ohm]",
}  # fmt: skip
SERVO = {"gain": "its firmware's gain"}
MORE = {
    "controller.rate_hz": "rate of the controller [Hz]", "nominal.stiffness": "stiffness, if known",
    "nominal.static_friction": "friction [N m]", "nominal.viscous_friction": "viscous friction [N m s/rad]",
    "nominal.reflected_inertia": "rotor inertia [kg m^2]", "gear": "gear, motor turns a turn",
    "length": "cut into trials of [s]", "initialisation": "initialisation of each file",
}  # fmt: skip
UNITS = {
    "time_unit": [*TIME_UNITS], "angle_unit": [*ANGLE_UNITS, RANGE, str(USUAL_TICKS)],
    "length_unit": [*LENGTH_UNITS], "torque_unit": [*TORQUE_UNITS],
}  # fmt: skip
ICON = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 48 48" fill="none" stroke="#000" stroke-width="3">{}</svg>'
ICONS = {
    "pendulum": '<path d="M12 5h24M24 5L35 32"/><circle cx="37" cy="37" r="6" fill="#000"/>',
    "wheel": '<circle cx="24" cy="24" r="17"/><circle cx="24" cy="24" r="3" fill="#000"/><path d="M24 24L36 12"/>',
    "slide": '<path d="M3 36h42M8 20h20v14H8zM33 27h11M40 22l5 5-5 5"/>',
}  # fmt: skip


class ImportForm:
    """What waits to be imported, and everything that may be said of it.

    Attributes:
        whole: its widgets.
    """

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.waiting, self.columns = text_of(), column_of()
        self.table = text_of(styles={"overflow-x": "auto"})
        self.seen: Preview | None = None  # as long as columns and joints stay, choices do
        self.robots = {robot: self._robot(robot) for robot in ROBOTS}
        self.said = text_of()
        self.texts = {
            key: TextInput(title=plain(title), width=150)
            for key, title in (ONE_JOINT | CONTROLLER | SERVO | MORE).items()
        }
        self.servo = Select(title="servo", options=[NONE, *map(plain, servos())], value=NONE, width=110)
        self.mode = Select(title="commands are", options=[*NEEDED], value="position", width=110)
        self.mode.on_change("value", lambda attr, old, new: self._show_motor())
        self.read = Select(title="a position is read", options=[BEFORE, "after"], value=BEFORE, width=170)
        self.units = {
            key: Select(
                title=plain(f"{key.removesuffix('_unit')} in"),
                options=[AUTO, *map(plain, units)],
                value=AUTO,
                width=150,
            )
            for key, units in UNITS.items()
        }
        self.before = Select(title="trials of this recording", options=[TOGETHER, ALONE], value=TOGETHER, width=200)
        more = Toggle(label="More: units, drive, trials", width=200, align="end")
        fold = row_of(*self.units.values(), *(self.texts[key] for key in MORE), visible=False)
        more.on_change("active", lambda attr, old, new: fold.update(visible=new))
        self.one_joint = [self.texts[key] for key in ONE_JOINT]
        self.whole = column_of(
            self.waiting,
            self.said,
            row_of(*self.robots.values(), *self.one_joint),
            self.table,
            self.columns,
            row_of(self.mode, self.read, *(self.texts[key] for key in CONTROLLER), self.servo, self.texts["gain"]),
            fold,
            row_of(button("Import", self._import, "primary"), more, self.before),
            name="importing",
            visible=False,
        )
        self._show_motor()

    def _robot(self, robot: str) -> Button:
        icon = SVGIcon(svg=ICON.format(ICONS[robot]), size=40)
        made = Button(label=plain(robot), icon=icon, width=130, height=52)
        made.on_click(lambda: self.desk.choose_robot(robot))
        return made

    def _show_motor(self) -> None:
        for key in ("kt", "R"):
            self.texts[f"controller.{key}"].visible = self.mode.value == "voltage"

    def show(self) -> None:
        """Show what waits."""
        desk, waiting = self.desk, self.desk.waiting
        self.whole.visible = bool(waiting.logs) or (waiting.urdf is not None and desk.bench is None)
        self.before.visible = desk.same_rig is not None
        rig = waiting.urdf.name if waiting.urdf else waiting.robot or "?"
        text = f"To be imported: {', '.join(path.name for path in waiting.logs)} with {rig}"
        if waiting.calibration is not None:
            text += f", calibrated by {waiting.calibration.name}"
        if desk.same_rig is not None:
            text += "; together with the trials of this recording, its gains hold where you state none"
        lacks = waiting.lacks
        show(self.waiting, listed([text]), listed([f"still needed: {' and '.join(lacks)}"] if lacks else [], YELLOW))
        self._show_robots(waiting.robot)
        if _names(desk.preview) != _names(self.seen):
            self._show_preview(desk.preview)

    def _show_robots(self, chosen: str | None) -> None:
        words = f"One joint without a URDF: it {ROBOTS[chosen]}." if chosen else "No URDF? One joint is a"
        show(self.said, words)
        for robot, made in self.robots.items():
            made.button_type = "primary" if robot == chosen else "default"
        for text in self.one_joint:
            text.visible = chosen is not None

    def _show_preview(self, seen: Preview | None) -> None:
        self.seen = seen
        show(self.table)
        self.columns.children = []
        if seen is None:
            return
        rows = [html(*(Html("<td>{:.6g}</td>").format(value) for value in row)) for row in seen.rows]
        head = html(*(Html("<th>{}</th>").format(name) for name in seen.columns))
        doubt = listed([seen.doubt] if seen.doubt else [], YELLOW)
        lines = html(*(Html("<tr>{}</tr>").format(row) for row in (head, *rows)))
        show(self.table, doubt, Html('<table cellpadding="4">{}</table>').format(lines))
        self.mode.value = seen.mode
        guess = _columns(seen)
        self.columns.children = [
            _columns_row("" if name == "time" else name, name, entry, seen.columns) for name, entry in guess.items()
        ]

    def _chosen_columns(self) -> dict[str, Any]:
        """As `source.columns`; nothing where they are as guessed."""
        chosen = {
            row.name: {select.title: select.value for select in row.children[1:]} for row in self.columns.children
        }
        if self.seen is None or chosen == _columns(self.seen):
            return {}
        known = {
            name: {signal: column for signal, column in entry.items() if column != NONE}
            for name, entry in chosen.items()
        }
        time = known.pop("time")
        return time | {joint: entry for joint, entry in known.items() if entry}

    def _import(self) -> None:
        shown = {key: text.value.strip() for key, text in self.texts.items() if text.visible}
        typed = {key: text for key, text in shown.items() if text}
        typed |= {key: select.value for key, select in self.units.items() if select.value != AUTO}
        typed |= {} if self.servo.value == NONE else {"servo": self.servo.value}
        typed |= {MODE: self.mode.value, READ: "before" if self.read.value == BEFORE else "after"}
        self.desk.import_waiting(typed, self._chosen_columns(), self.before.value == TOGETHER)


def _names(seen: Preview | None) -> tuple[list[str], list[str]] | None:
    return None if seen is None else (seen.columns, seen.joints)


def _columns(seen: Preview) -> dict[str, dict[str, str]]:
    """Joint, and before them `time` -> signal -> column as guessed."""
    joints = seen.guess.joints if seen.guess else {}
    time = (seen.guess.time if seen.guess else None) or NONE
    return {"time": {"time": time}} | {
        joint: {signal: joints.get(joint, {}).get(signal, NONE) for signal in SIGNALS} for joint in seen.joints
    }


def _columns_row(label: str, name: str, chosen: dict[str, str], columns: list[str]) -> Row:
    """A select of columns for each signal, with the column that is chosen."""
    selects = []
    for signal, value in chosen.items():
        selects.append(Select(title=plain(signal), width=140))
        choose(selects[-1], [NONE, *columns], value)
    name_of = Div(width=80, disable_math=True, styles={"overflow-wrap": "anywhere"})
    show(name_of, label)
    return row_of(name_of, *selects, name=name)
