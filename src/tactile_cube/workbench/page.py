"""One window of a workbench: it shows the desk and hands on what is clicked, and computes nothing."""

from __future__ import annotations

import base64
import functools

from bokeh.document import Document
from bokeh.models import (
    CheckboxGroup,
    FileInput,
    LayoutDOM,
    MultiSelect,
    PrintfTickFormatter,
    RadioGroup,
    Select,
    Slider,
    TextInput,
)
from tornado.ioloop import IOLoop

from tactile_cube.measurement.comparing.error import FailingInterval
from tactile_cube.measurement.replay.model import effect_path
from tactile_cube.measurement.units import milli
from tactile_cube.visualization.charts import SIMULATED
from tactile_cube.workbench.cards import card
from tactile_cube.workbench.charts import ExperimentChart, MissingChart, TimeChart
from tactile_cube.workbench.desk import Desk, number
from tactile_cube.workbench.import_form import ImportForm
from tactile_cube.workbench.importing import LOGS, RIGS
from tactile_cube.workbench.missing_torque import signal_of, signals
from tactile_cube.workbench.parameters import Value
from tactile_cube.workbench.state import Look, Workbench
from tactile_cube.workbench.tables import FOLDED, error_by_stage, over_noise, residual_test
from tactile_cube.workbench.text import LABEL, Html, choose, choose_several, html, listed, plain, show
from tactile_cube.workbench.widgets import NONE, RED, YELLOW, button, column_of, row_of, text_of

SLIDERS = 12  # of one joint; laws with more numbers are profiles, which nobody sets by hand
DOWNLOAD = Html('<a href="next_experiment.csv" download>Download CSV</a>')
LINE = {"border-top": "1px solid #d0d7de"}


class Page:
    """The widgets of one window."""

    def __init__(self, document: Document, desk: Desk) -> None:
        self.document, self.desk = document, desk
        self.version = -1
        self.showing = False  # while the desk's state is put into widgets, their callbacks are ours
        self.form = ImportForm(desk)
        self.time, self.missing, self.experiment = TimeChart(), MissingChart(), ExperimentChart()
        self.status = text_of(name="status")
        self.parts = [self._section(*one) for one in self._sections()]
        for part in (self._open_part(), self.status, self.form.whole, *self.parts):
            document.add_root(part)
        self._pending, self._loop, listener = False, IOLoop.current(), self._soon
        desk.listeners.append(listener)
        document.on_session_destroyed(lambda context: desk.listeners.remove(listener))
        self.refresh()

    # What stands where

    def _sections(self) -> list[tuple[str, str, LayoutDOM]]:
        return [
            ("compare", "Compare", self._compare_part()),
            ("missing", "Missing torque", self._missing_part()),
            ("candidates", "What may be missing", self._candidates_part()),
            ("diagnosis", "Diagnosis", self._diagnosis_part()),
            ("stages", "Error by stage", self._stages_part()),
            ("values", "Numbers of the model", self._values_part()),
            ("next", "Next experiment", self._next_part()),
            ("save", "Save", self._save_part()),
        ]

    def _section(self, name: str, title: str, part: LayoutDOM) -> LayoutDOM:
        head = text_of(Html('<h2 style="font-size:16px;margin:8px 0 0">{}</h2>').format(title), styles=LINE)
        return column_of(head, part, name=name, visible=False)

    def _open_part(self) -> LayoutDOM:
        self.path = TextInput(title="Folder of a recording, logs (*.csv), URDF or model.yaml", width=460)
        files = FileInput(accept=",".join((*LOGS, *RIGS)), multiple=True, title="or drop files anywhere")
        # names come after contents
        take = functools.partial(self._take, files)
        files.on_change("value", lambda attr, old, new: self.document.add_next_tick_callback(take))
        return row_of(self.path, button("Open", lambda: self.desk.open(self.path.value)), files, name="open")

    def _compare_part(self) -> LayoutDOM:
        self.trial = Select(title="trial", width=190)
        self.joint = Select(title="joint", width=90)
        self.other = Select(title="beside", options=[NONE], value=NONE, width=190)
        self.where = Select(title="where it fails", options=[NONE], value=NONE, width=190)
        self.over = MultiSelect(title="errors of other trials", size=3, width=190)
        for select in (self.trial, self.joint, self.other, self.over):
            select.on_change("value", lambda attr, old, new: self._again())
        self.where.on_change("value", lambda attr, old, new: self._zoom())
        self.sentences = text_of()
        choices = row_of(self.trial, self.joint, self.other, self.where, self.over)
        return column_of(choices, *self.time.figures, self.sentences)

    def _missing_part(self) -> LayoutDOM:
        self.signal = Select(title="over", width=300)
        self.signal.on_change("value", lambda attr, old, new: self._again())
        return column_of(self.signal, self.missing.figure)

    def _stages_part(self) -> LayoutDOM:
        self.stairs = text_of()
        undo = button("Undo", lambda: self.desk.change("undo", lambda bench: bench.undo()))
        return column_of(self.stairs, row_of(undo))

    def _candidates_part(self) -> LayoutDOM:
        self.looks: list[Look] = []
        self.ranked = RadioGroup(labels=[], sizing_mode="stretch_width")
        self.ranked.on_change("active", lambda attr, old, new: self._look_closer())
        self.another = Select(title="another effect", width=260)
        self.another.on_change("value", lambda attr, old, new: self._another())
        self.card, self.unseen = text_of(), text_of()
        add = button("Add and refit", self._add, "primary")
        return column_of(self.ranked, row_of(self.another, add), self.card, self.unseen)

    def _diagnosis_part(self) -> LayoutDOM:
        self.start = button("Diagnose", self._start_or_stop)
        self.accept = button("Add what it found", self._accept, "primary")
        self.progress = text_of()
        return column_of(row_of(self.start, self.accept), self.progress)

    def _values_part(self) -> LayoutDOM:
        self.values: list[Value] = []
        self.sliders = column_of()
        self.number = Select(title="number", width=200)
        self.number.on_change("value", lambda attr, old, new: self._show_number())
        self.typed = [TextInput(title=plain(title), width=90) for title in ("value", "at least", "at most")]
        self.fixed = CheckboxGroup(labels=["fixed"], width=70, align="end")
        self.present = Select(title="effects of the model", width=260)
        self.remove = button("Remove and refit", self._remove)
        refit = button("Refit", lambda: self.desk.change("refitting", lambda bench: bench.refit()))
        return column_of(
            self.sliders,
            row_of(self.number, *self.typed, self.fixed, button("Set", self._set_typed), refit),
            row_of(self.present, self.remove),
        )

    def _next_part(self) -> LayoutDOM:
        self.proposal = text_of()
        self.experiment.figure.visible = False
        return column_of(row_of(button("Propose", self.desk.propose)), self.proposal, self.experiment.figure)

    def _save_part(self) -> LayoutDOM:
        self.folder = TextInput(title="folder", value=str(self.desk.folder / "model"), width=300)
        return row_of(self.folder, button("Save", lambda: self.desk.save(self.folder.value)))

    # What is clicked

    def _take(self, files: FileInput) -> None:
        names, values = files.filename, files.value
        if names and values:
            self.desk.take(list(names), [base64.b64decode(value) for value in values])

    def _again(self) -> None:
        if not self.showing:
            self._show_curves()

    def _zoom(self) -> None:
        if not self.showing and self.where.value != NONE:
            start, end = self.where.value.split("|")
            self.time.zoom(float(start), float(end))

    @property
    def candidate(self) -> str:
        """The effect that is chosen, by its name; empty: none is."""
        if self.ranked.active is not None:
            return self.looks[int(self.ranked.active)].name
        return "" if self.another.value == NONE else str(self.another.value)

    def _look_closer(self) -> None:
        if not self.showing and self.ranked.active is not None:
            self.another.value = NONE
            look = self.looks[self.ranked.active]
            self.desk.draw(look, f"{look.name}@{self.joint.value}")
            self._show_card()

    def _another(self) -> None:
        if not self.showing and self.another.value != NONE:
            self.ranked.active = None
            self._show_card()

    def _add(self) -> None:
        if self.candidate:
            label = f"{self.candidate}@{self.joint.value}"
            self.desk.change(f"adding {label}", lambda bench: bench.add(label))

    def _remove(self) -> None:
        label = self.present.value
        self.desk.change(f"removing {label}", lambda bench: bench.remove(label))

    def _start_or_stop(self) -> None:
        (self.desk.diagnose if self.desk.diagnosing is None else self.desk.stop)()

    def _accept(self) -> None:
        found = self.desk.found
        if found is not None:
            self.desk.change("adding what was found", lambda bench: bench.adopt(found))

    def _move(self, one: Value, value: float) -> None:
        bench = self.desk.bench
        if bench is not None:
            self.time.move(bench.simulate(self.trial.value, one.unknown.put(bench.stage.model, value)).position)

    def _set(self, one: Value, value: float) -> None:
        if value != one.value:
            self.desk.change(f"setting {one.key}", lambda bench: bench.set_parameter(one.key, value))

    def _set_typed(self) -> None:
        key, fixed, texts = self.number.value, bool(self.fixed.active), [one.value for one in self.typed]

        def work(bench: Workbench) -> None:
            value, low, high = (number(key, text) for text in texts)
            bench.bound(key, *((value, value) if fixed else (low, high)))
            bench.set_parameter(key, value)

        if key:
            self.desk.change(f"setting {key}", work)

    # What is shown

    def _soon(self) -> None:
        """Show the desk as it will be when the window's turn comes; called from any thread."""
        if not self._pending:
            self._pending = True
            self._loop.add_callback(self._next)

    def _next(self) -> None:
        if self._soon in self.desk.listeners:  # else the window was closed in the meantime
            self.document.add_next_tick_callback(self.refresh)

    def refresh(self) -> None:
        """Show the desk."""
        self._pending = False
        self.showing = True
        try:
            self._show()
        finally:
            self.showing = False

    def _show(self) -> None:
        desk, bench = self.desk, self.desk.bench
        self._show_status()
        self.form.show()
        self.start.label = "Diagnose" if desk.diagnosing is None else "Stop"
        known = bench.effects if bench else []
        self.accept.disabled = not (desk.found and set(desk.found.effects) - set(known))
        show(self.progress, self._progress())
        if bench is None:
            return
        for part in self.parts:
            part.visible = True
        renewed = self.version != desk.version
        if renewed:
            self.version = desk.version
            self._show_model(bench)
        self._show_candidates(bench)
        self._show_experiment(bench)
        self._show_curves(only_missing=not renewed)

    def _show_status(self) -> None:
        desk = self.desk
        busy = listed([f"\u25cf {desk.busy} ..."] if desk.busy else [], f"color:{SIMULATED}")
        problem = listed([desk.problem] if desk.problem else [], RED)
        doubts = [one for one in desk.notes if one.startswith(("warning: ", "guess: "))]
        notes = html(listed(doubts, YELLOW), listed(one for one in desk.notes if one not in doubts))
        hint = "" if desk.bench or desk.waiting.logs else "Open a recording, or drop logs."
        live = Html('<div role="status" aria-live="polite">{}</div>')
        show(self.status, live.format(html(busy, problem, notes, hint)))

    def _show_model(self, bench: Workbench) -> None:
        recording = bench.recording
        trials = [t.name for t in recording.trials if t.name in bench.never_fitted]
        others = [t.name for t in recording.trials if t.name not in bench.never_fitted]
        choose(self.trial, [(name, f"{name} (never fitted)") for name in trials] + [(name, name) for name in others])
        choose(self.joint, list(recording.joints), "" if self.joint.value else recording.joints[-1])
        choose_several(self.over, [*trials, *others])
        choose(self.other, [NONE, *(f"{k}: {one.label}" for k, one in enumerate(bench.stages[:-1]))])
        choose(self.present, bench.effects)
        self.remove.disabled = not bench.effects
        show(self.stairs, error_by_stage(bench))

    def _progress(self) -> Html:
        """How far the diagnosis is, or what it answered."""
        progress, found = self.desk.progress, self.desk.found
        if progress is None:
            return html()
        log = FOLDED.format(f"{len(progress.lines)} steps", listed(progress.lines))
        if found is not None:
            masked = " without the intervals that it masked" if found.left_out else ""
            names = " and ".join(found.effects) or "no effect"
            head = f"Error over noise with {names}: {over_noise(found.over_noise)}{masked}."
            text = Html("\n").join(found.text.splitlines())
            return html(head, Html('<pre style="white-space:pre-wrap">{}</pre>').format(text), log)
        if self.desk.outcome:
            return html(listed([self.desk.outcome]), log)
        done = f"about {100 * progress.share:.0f} % done"
        left = f", about {progress.left:.0f} s left" if progress.share > 0.0 else ""
        return html(listed([done + left, f"best so far: {progress.best or 'nothing yet'}"]), log)

    def _show_candidates(self, bench: Workbench) -> None:
        joint = self.joint.value
        groups = self.desk.looks.get(joint)
        tag = [self.desk.version, joint, groups is not None]
        if self.ranked.tags == tag:
            return
        self.ranked.tags = tag
        self.looks = [look for group in groups or [] for look in group]
        leaders = [group[0].name for group in groups or [] for _ in group]
        self.ranked.active = None
        self.ranked.labels = [
            plain(f"{100 * look.share:.0f} %  {look.name}" + (f" (looks like {leader})" if look.name != leader else ""))
            for leader, look in zip(leaders, self.looks, strict=True)
        ]
        if groups is None:
            self.desk.look(joint)
        unseen = bench.unseen(joint)
        names = {one.effect for one in unseen} | {look.name for look in self.looks}
        names |= {one.removesuffix(f"@{joint}") for one in bench.effects if one.endswith(f"@{joint}")}
        every = sorted(effect_path(effect) for effect in bench.search.effects)
        choose(self.another, [NONE, *(name for name in every if name not in names)], NONE)
        reach = self.desk.explainable.get(joint)
        bound = "" if reach is None else f" Any law of the logged signals: {100 * reach:.0f} % of the missing torque."
        show(
            self.unseen,
            f"Part of the squared error on fitted trials that each takes away by itself.{bound}",
            FOLDED.format(f"{len(unseen)} cannot be seen", listed(f"{one.effect}: {one.why}" for one in unseen)),
        )

    def _show_card(self) -> None:
        """The chosen candidate's card, and what it would leave once that is known."""
        bench, label = self.desk.bench, f"{self.candidate}@{self.joint.value}"
        if bench is None or not self.candidate:
            show(self.card)
            return
        lines = []
        if self.desk.chosen == label:
            now, then = bench.stage.over_noise, self.desk.promised
            verdict = "would not get smaller" if then >= now else "would fall"
            lines = [
                f"error over noise {verdict}: {over_noise(now)} to {over_noise(then)}, before the rest is refitted"
            ]
        show(self.card, card(self.candidate, *lines))

    def _show_number(self) -> None:
        one = next((one for one in self.values if one.key == self.number.value), None)
        if one is not None:
            for text, value in zip(self.typed, (one.value, one.unknown.low, one.unknown.high), strict=True):
                text.value = f"{value:.6g}"
            self.fixed.active = [0] if one.fixed else []

    def _show_experiment(self, bench: Workbench) -> None:
        proposed = self.desk.experiment
        self.experiment.figure.visible = proposed is not None
        if proposed is None:
            show(self.proposal)
            return
        safety = "keeps to the limits" if proposed.safety.safe else "would LEAVE the limits, do not play it"
        worth = f"evidence expected: {proposed.told:.3g} times what decides" if proposed.decides else "decides nothing"
        pair = " and ".join(proposed.predictions) or "the models"
        line = f"{proposed.name}, {proposed.time[-1]:.1f} s, to tell {pair} apart: {worth}; {safety} (dashed)"
        show(self.proposal, listed([line]), DOWNLOAD if proposed.decides else "")
        if self.experiment.figure.tags != [self.desk.version, id(proposed)]:
            self.experiment.figure.tags = [self.desk.version, id(proposed)]
            self.experiment.show(proposed, list(bench.recording.units.values()))

    def _show_curves(self, only_missing: bool = False) -> None:
        bench, joint = self.desk.bench, self.joint.value
        if bench is None or not joint:
            return
        before, self.showing = self.showing, True
        try:
            if not only_missing:
                self._show_trial(bench, joint)
                self._show_sliders(bench, joint)
                self._show_candidates(bench)
            tag = [self.desk.version, joint, self.signal.value, self.desk.chosen]
            if self.signal.tags != tag:
                self._show_missing(bench, joint)
                self.signal.tags = [*tag[:2], self.signal.value, tag[3]]
            self._show_card()
        finally:
            self.showing = before

    def _show_missing(self, bench: Workbench, joint: str) -> None:
        missing, law = bench.missing(joint), self.desk.signature
        law = law if law is not None and law.joint == joint else None
        offered, chosen = signals(missing), ""
        if law is not None and self.signal.tags[3:] != [self.desk.chosen] and self.ranked.active is not None:
            of = signal_of(self.looks[self.ranked.active].candidate.effect)
            chosen = next(one for one in offered if one.startswith(("time", f"{of} of {joint} ")[of != "time"]))
        choose(self.signal, offered, chosen)
        self.missing.show(missing, self.signal.value, law, bench.recording.units[joint])

    def _show_trial(self, bench: Workbench, joint: str) -> None:
        place = bench.recording.joints.index(joint)
        compared = bench.comparison(self.trial.value)
        beside = None
        if self.other.value != NONE:
            other = bench.stages[int(self.other.value.partition(":")[0])]
            beside = bench.simulate(self.trial.value, other.model).position
        others = [name for name in self.over.value if name != self.trial.value]
        self.time.show(compared, place, beside, [(bench.trial(one), bench.simulate(one).position) for one in others])
        unit = bench.recording.units[joint]
        failing = [one for one in compared.failing_intervals if one.joint == joint]
        failing.sort(key=lambda one: -one.error)
        self.where.value = NONE
        choose(self.where, [NONE, *(_interval(one, unit) for one in failing[:20])])
        error = f"{joint} in this trial: {milli(compared.errors.joints[joint], unit)} RMS of the free run"
        lines = listed([error, *(one for one in compared.sentences if one.startswith(f"{joint} "))])
        show(self.sentences, lines, residual_test(compared, joint))

    def _show_sliders(self, bench: Workbench, joint: str) -> None:
        tag = [self.desk.version, joint]
        if self.sliders.tags != tag:
            self.sliders.tags, self.values = tag, bench.values(joint)
            self.sliders.children = [self._slider(one) for one in self.values[-SLIDERS:]]
            choose(self.number, [one.key for one in self.values])
            self._show_number()

    def _slider(self, one: Value) -> Slider:
        name = one.key.replace(f"@{self.joint.value}", "")
        found = "" if one.interval is None else f" in [{one.interval[0]:.4g}, {one.interval[1]:.4g}]"
        found = " fixed" if one.fixed else found
        low, high = one.unknown.low, one.unknown.high
        slider = Slider(
            start=low, end=high, value=one.value, step=(high - low) / 1000, sizing_mode="stretch_width",
            title=plain(f"{name} [{one.unit}]: {one.value:.4g}{found}; now", 3 * LABEL),
            format=PrintfTickFormatter(format="%.4g"),
        )  # fmt: skip
        slider.on_change("value", lambda attr, old, new: self._move(one, new))
        slider.on_change("value_throttled", lambda attr, old, new: self._set(one, new))
        return slider


def _interval(one: FailingInterval, unit: str) -> tuple[str, str]:
    return f"{one.start}|{one.end}", f"{one.start:.2f} to {one.end:.2f} s: {milli(one.error, unit)}"
