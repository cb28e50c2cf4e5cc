"""The form by which logs are imported: first rows, which column is what, and what is known of the rig."""

from functools import partial
from typing import Any

from bokeh.models import Row, SVGIcon, Toggle

from tactile_cube.measurement.sources import units
from tactile_cube.measurement.sources.column_map import NEEDED
from tactile_cube.measurement.sources.mechanism import ROBOTS, servos
from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.importing import Preview
from tactile_cube.workbench.tables import CELL, HEAD, ROW, TABLE
from tactile_cube.workbench.text import choose, html, listed, show
from tactile_cube.workbench.widgets import NONE, YELLOW, button, column_of, field, row_of, select, text_of

AUTO, BEFORE = "by name, values", "before its command"
TOGETHER, ALONE = "together with these", "left out"
ONE_JOINT = {"mass": "its mass [kg], if known", "lever": "its lever [m], if known"}
MOTOR = {"controller.kt": "kt [N m/A]", "controller.R": "R [ohm]"}
CONTROLLER = {
    "controller.kp": "K_P [N m/rad]", "controller.kd": "K_D [N m s/rad]",
    "controller.torque_limit": "torque limit [N m]",
}  # fmt: skip
SERVO = {"gain": "its firmware's gain"}
MORE = {
    "controller.rate_hz": "rate of the controller [Hz]", "nominal.stiffness": "stiffness, if known",
    "nominal.static_friction": "friction [N m]", "nominal.viscous_friction": "viscous friction [N m s/rad]",
    "nominal.reflected_inertia": "rotor inertia [kg m^2]", "gear": "gear, motor turns a turn",
    "length": "cut into trials of [s]", "initialisation": "initialisation of each file",
}  # fmt: skip
UNITS = {
    "time_unit": [*units.TIME_UNITS], "angle_unit": [*units.ANGLE_UNITS, units.RANGE, str(units.USUAL_TICKS)],
    "length_unit": [*units.LENGTH_UNITS], "torque_unit": [*units.TORQUE_UNITS],
}  # fmt: skip
ICON = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 48 48" fill="none" stroke="#000" stroke-width="3">{}</svg>'
ICONS = {
    "pendulum": '<path d="M12 5h24M24 5L35 32"/><circle cx="37" cy="37" r="6" fill="#000"/>',
    "wheel": '<circle cx="24" cy="24" r="17"/><circle cx="24" cy="24" r="3" fill="#000"/><path d="M24 24L36 12"/>',
    "slide": '<path d="M3 36h42M8 20h20v14H8zM33 27h11M40 22l5 5-5 5"/>',
}  # fmt: skip


class ImportForm:
    """What waits to be imported, and everything that may be said of it; `whole` has all widgets."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.seen: Preview | None = None  # as long as its columns stay, choices do
        self.waiting, self.said, self.columns = text_of(), text_of(), column_of()
        self.table = text_of(styles={"overflow-x": "auto"})
        self.robots = {
            robot: button(
                robot,
                partial(desk.choose_robot, robot),
                icon=SVGIcon(svg=ICON.format(svg), size=40),
                width=130,
                height=52,
            )
            for robot, svg in ICONS.items()
        }
        self.texts = {key: field(title) for key, title in (ONE_JOINT | CONTROLLER | MOTOR | SERVO | MORE).items()}
        self.mode = select("commands are", *NEEDED, width=110)
        self.mode.on_change("value", lambda attr, old, new: self._show_motor())
        self.servo = select("servo", NONE, *servos(), width=140)
        self.read = select("a position is read", BEFORE, "after", width=170)
        self.units = {
            key: select(f"{key.removesuffix('_unit')} in", AUTO, *known, width=150) for key, known in UNITS.items()
        }
        self.before = select("trials of this recording", TOGETHER, ALONE, width=200)
        more = Toggle(label="More: units, drive, trials", width=200, align="end")
        fold = row_of(*self.units.values(), *self._texts(MORE), visible=False)
        more.on_change("active", lambda attr, old, new: fold.update(visible=new))
        self.whole = column_of(
            self.waiting,
            self.said,
            row_of(*self.robots.values(), *self._texts(ONE_JOINT)),
            self.table,
            self.columns,
            row_of(self.mode, self.read, *self._texts(CONTROLLER | MOTOR), self.servo, *self._texts(SERVO)),
            fold,
            row_of(button("Import", self._import, "primary"), more, self.before),
            name="importing",
            visible=False,
        )
        self._show_motor()

    def _texts(self, keys: dict[str, str]) -> list[Any]:
        return [self.texts[key] for key in keys]

    def _show_motor(self) -> None:
        for text in self._texts(MOTOR):
            text.visible = self.mode.value == "voltage"

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
        lacks = [f"still needed: {' and '.join(waiting.lacks)}"] if waiting.lacks else []
        show(self.waiting, listed([text]), listed(lacks, YELLOW))
        chosen = waiting.robot
        words = f"One joint without a URDF: it {ROBOTS[chosen]}." if chosen else "No URDF? One joint is a"
        show(self.said, words)
        for robot, made in self.robots.items():
            made.button_type = "primary" if robot == chosen else "default"
        for one in self._texts(ONE_JOINT):
            one.visible = chosen is not None
        seen, self.seen = self.seen, desk.preview
        if _names(seen) != _names(self.seen):
            self._show_preview()

    def _show_preview(self) -> None:
        seen = self.seen
        show(self.table)
        self.columns.children = []
        if seen is None:
            return
        rows = [html(*map(HEAD.format, seen.columns))]
        rows += [html(*(CELL.format(f"{value:.6g}") for value in row)) for row in seen.rows]
        doubt = listed([seen.doubt] if seen.doubt else [], YELLOW)
        show(self.table, doubt, TABLE.format("", html(*map(ROW.format, rows))))
        self.mode.value = seen.mode
        self.columns.children = [self._columns_of(*one, seen.columns) for one in seen.guess.items()]

    def _columns_of(self, name: str, guess: dict[str, str], columns: list[str]) -> Row:
        """Make a select of columns for each signal of a joint, or for the time."""
        selects = [select(signal, width=140) for signal in guess]
        for one, column in zip(selects, guess.values(), strict=True):
            choose(one, [NONE, *columns], column)
        return row_of(text_of("" if name == "time" else name, sizing_mode="fixed", width=80), *selects, name=name)

    def _chosen_columns(self) -> dict[str, Any]:
        """Return the chosen columns as `source.columns`; nothing if they are as guessed."""
        chosen = {
            row.name: {one.title: "" if one.value == NONE else one.value for one in row.children[1:]}
            for row in self.columns.children
        }
        if self.seen is None or chosen == self.seen.guess:
            return {}
        known = {name: {signal: column for signal, column in one.items() if column} for name, one in chosen.items()}
        return known.pop("time") | {joint: entry for joint, entry in known.items() if entry}

    def _import(self) -> None:
        typed = {key: text.value.strip() for key, text in self.texts.items() if text.visible and text.value.strip()}
        typed |= {key: one.value for key, one in self.units.items() if one.value != AUTO}
        typed |= {} if self.servo.value == NONE else {"servo": self.servo.value}
        typed |= {"controller.mode": self.mode.value, "read": "before" if self.read.value == BEFORE else "after"}
        self.desk.import_waiting(typed, self._chosen_columns(), self.before.value == TOGETHER)


def _names(seen: Preview | None) -> tuple[list[str], list[str]] | None:
    return None if seen is None else (seen.columns, [*seen.guess])
