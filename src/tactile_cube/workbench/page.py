"""One window of a workbench: it shows the state and passes clicks on, and computes nothing."""

import base64
from collections.abc import Callable

from bokeh import models
from bokeh.document import Document
from tornado.ioloop import IOLoop

from tactile_cube.identification.in_words import next_steps
from tactile_cube.measurement.replay.model import effect_path
from tactile_cube.measurement.units import milli, named
from tactile_cube.visualization.charts import SIMULATED
from tactile_cube.workbench.charts import ExperimentChart, MissingChart, TimeChart
from tactile_cube.workbench.desk import Desk
from tactile_cube.workbench.import_form import ImportForm
from tactile_cube.workbench.importing import LOGS, RIGS, number
from tactile_cube.workbench.missing_torque import signals
from tactile_cube.workbench.parameters import Value
from tactile_cube.workbench.state import Look, Workbench
from tactile_cube.workbench.tables import FOLDED, card, error_by_stage, error_of_trial
from tactile_cube.workbench.text import LABEL, Html, choose, html, listed, plain, show
from tactile_cube.workbench.widgets import NONE, RED, YELLOW, button, column_of, field, row_of, select, text_of

SLIDERS = 12  # of one joint; laws with more numbers are profiles, which nobody sets by hand
MOST = 20  # failing intervals, the worst
DOWNLOAD = Html('<a href="next_experiment.csv" download>Download CSV</a> (rad, m, s)')
TITLE, LINE = Html('<h2 style="font-size:16px;margin:8px 0 0">{}</h2>'), {"border-top": "1px solid #d0d7de"}
LIVE = Html('<div role="status" aria-live="polite">{}</div>')
ANSWER = Html('<pre style="white-space:pre-wrap">{}</pre>')


class Page:
    """The widgets of one window; each part is drawn anew when what it depends on has changed."""

    def __init__(self, document: Document, desk: Desk) -> None:
        self.document, self.desk = document, desk
        self.showing = False  # while the desk's state is put into widgets, their callbacks are ours
        self.drawn: dict[str, tuple[object, ...]] = {}  # part -> what it depended on when it was drawn
        self.form, self.status, self.stairs = ImportForm(desk), text_of(name="status"), text_of()
        self.missing, self.signal = MissingChart(), select("over", width=300)
        self.experiment, self.proposal = ExperimentChart(), text_of()
        folder = field("folder", 300, value=str(desk.folder / "model"))
        self._when(self.signal)
        undo = button("Undo", lambda: desk.change("undo", Workbench.undo))
        propose = button("Propose", desk.propose)
        steps: dict[str, tuple[str, list[models.LayoutDOM]]] = {
            "compare": ("Compare", self._compare_part()),
            "missing": ("Missing torque", [self.signal, self.missing.figure]),
            "candidates": ("What may be missing", self._candidates_part()),
            "diagnosis": ("Diagnosis", self._diagnosis_part()),
            "stages": ("Error by stage", [self.stairs, row_of(undo)]),
            "values": ("Numbers of the model", self._values_part()),
            "next": ("Next experiment", [row_of(propose), self.proposal, self.experiment.figure]),
            "save": ("Save", [row_of(folder, button("Save", lambda: self.desk.save(folder.value)))]),
        }
        self.steps = [
            column_of(text_of(TITLE.format(title), styles=LINE), *parts, name=name, visible=False)
            for name, (title, parts) in steps.items()
        ]
        for part in (self._open_part(), self.status, self.form.whole, *self.steps):
            document.add_root(part)
        self._pending, self._loop, listener = False, IOLoop.current(), self._soon
        desk.listeners.append(listener)
        document.on_session_destroyed(lambda context: desk.listeners.remove(listener))
        self.refresh()

    def _when(self, widget: models.Model, work: Callable[[], object] = lambda: None, what: str = "value") -> None:
        """Do something, and show what came of it, when somebody changes a widget."""

        def changed(attr: str, old: object, new: object) -> None:
            if not self.showing:
                work()
                self.refresh()

        widget.on_change(what, changed)

    def _new(self, part: str, *depends_on: object) -> bool:
        """Return whether a part must be drawn anew, and store what it depends on."""
        changed = self.drawn.get(part) != depends_on
        self.drawn[part] = depends_on
        return changed

    # What stands where

    def _open_part(self) -> models.LayoutDOM:
        path = field("Folder of a recording, logs (*.csv), URDF or model.yaml", 460)
        files = models.FileInput(accept=",".join((*LOGS, *RIGS)), multiple=True, title="or drop files anywhere")

        def take() -> None:
            if files.filename and files.value:
                self.desk.take(list(files.filename), [base64.b64decode(value) for value in files.value])

        # names come after contents
        files.on_change("value", lambda attr, old, new: self.document.add_next_tick_callback(take))
        return row_of(path, button("Open", lambda: self.desk.open(path.value)), files, name="open")

    def _compare_part(self) -> list[models.LayoutDOM]:
        self.time, self.sentences = TimeChart(), text_of()
        self.trial, self.joint = select("trial"), select("joint", width=120)
        self.other, self.where = select("beside", NONE), select("where it fails", NONE)
        self.over = models.MultiSelect(title="errors of other trials", size=3, width=190)
        for one in (self.trial, self.joint, self.other, self.over):
            self._when(one)
        self._when(self.where, self._zoom)
        choices = row_of(self.trial, self.joint, self.other, self.where, self.over)
        return [choices, *self.time.figures, self.sentences]

    def _candidates_part(self) -> list[models.LayoutDOM]:
        self.looks: list[Look] = []
        self.ranked = models.RadioGroup(labels=[], sizing_mode="stretch_width")
        self.another = select("another effect", width=260)
        self._when(self.ranked, self._look_closer, "active")
        self._when(self.another, lambda: self.another.value == NONE or self.ranked.update(active=None))
        self.card, self.unseen = text_of(), text_of()
        add = button("Add and refit", self._add, "primary")
        return [self.ranked, row_of(self.another, add), self.card, self.unseen]

    def _diagnosis_part(self) -> list[models.LayoutDOM]:
        self.start = button("Diagnose", lambda: (self.desk.stop if self.desk.running else self.desk.diagnose)())
        self.accept = button("Add what it found", self._accept, "primary")
        self.progress = text_of()
        return [row_of(self.start, self.accept), self.progress]

    def _values_part(self) -> list[models.LayoutDOM]:
        self.values: dict[str, Value] = {}
        self.sliders, self.number = column_of(), select("number", width=175)
        self._when(self.number, self._show_number)
        self.typed = [field(title, 90) for title in ("value", "at least", "at most")]
        self.fixed = models.CheckboxGroup(labels=["fixed"], width=70, align="end")
        self.present = select("effects of the model", width=260)
        self.remove = button("Remove and refit", lambda: self._change("removing", self.present.value, Workbench.remove))
        typed = (self.number, *self.typed, self.fixed, button("Set", self._set_typed))
        refit = button("Refit", lambda: self.desk.change("refitting", Workbench.refit))
        return [self.sliders, row_of(*typed, refit), row_of(self.present, self.remove)]

    # What is clicked

    def _zoom(self) -> None:
        if self.where.value != NONE:
            start, end = self.where.value.split("|")
            self.time.zoom(float(start), float(end))

    @property
    def candidate(self) -> str:
        """The effect that is chosen, by its name; empty: none is."""
        if self.ranked.active is not None:
            return self.looks[int(self.ranked.active)].name
        return "" if self.another.value == NONE else str(self.another.value)

    def _look_closer(self) -> None:
        if self.ranked.active is not None:
            self.another.value = NONE
            look = self.looks[self.ranked.active]
            self.desk.draw(look, f"{look.name}@{self.joint.value}")

    def _add(self) -> None:
        if self.candidate:
            self._change("adding", f"{self.candidate}@{self.joint.value}", Workbench.add)

    def _change(self, how: str, label: str, work: Callable[[Workbench, str], object]) -> None:
        self.desk.change(f"{how} {label}", lambda bench: work(bench, label))

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
        self._pending, self.showing = False, True
        try:
            self._show_status()
            self.form.show()
            if self.desk.bench is not None:
                self._show(self.desk.bench)
        finally:
            self.showing = False

    def _show(self, bench: Workbench) -> None:
        desk = self.desk
        for step in self.steps:
            step.visible = True
        self._show_diagnosis(bench)
        if self._new("model", desk.version):
            self._show_model(bench)
        joint, chosen = self.joint.value, desk.chosen
        if self._new("trial", desk.version, joint, self.trial.value, self.other.value, *self.over.value):
            self._show_trial(bench, joint)
        if self._new("values", desk.version, joint):
            self.values = {one.key: one for one in bench.values(joint)}
            self.sliders.children = [self._slider(one) for one in [*self.values.values()][-SLIDERS:]]
            choose(self.number, list(self.values))
            self._show_number()
        if self._new("candidates", desk.version, joint, joint in desk.looks):
            self._show_candidates(bench, joint)
        law = desk.signature if desk.signature is not None and desk.signature.joint == joint else None
        if self._new("signals", desk.version, joint, chosen):
            units = bench.recording.shown
            offered = [(signal, named(signal, units)[0]) for signal in signals(bench.missing(joint))]
            choose(self.signal, offered, signals(law)[0] if law else "")
        if self._new("missing", desk.version, joint, chosen, self.signal.value):
            self.missing.show(bench.missing(joint), self.signal.value, law, bench.recording.shown)
        if self._new("card", desk.version, joint, chosen, self.candidate):
            self._show_card(bench)
        if self._new("experiment", desk.version, desk.experiment):
            self._show_experiment(bench)

    def _show_status(self) -> None:
        desk = self.desk
        busy = listed([f"\u25cf {desk.busy} ..."] if desk.busy else [], f"color:{SIMULATED}")
        problem = listed([desk.problem] if desk.problem else [], RED)
        doubts = [one for one in desk.notes if one.startswith(("warning: ", "guess: "))]
        notes = html(listed(doubts, YELLOW), listed(one for one in desk.notes if one not in doubts))
        hint = "" if desk.bench or desk.waiting.logs else "Open a recording, or drop logs."
        show(self.status, LIVE.format(html(busy, problem, notes, hint)))

    def _show_diagnosis(self, bench: Workbench) -> None:
        """Show the progress of the diagnosis, or its result."""
        desk, found = self.desk, self.desk.found
        self.start.label = "Stop" if desk.running else "Diagnose"
        self.accept.disabled = found is None or not set(found.effects) - set(bench.effects)
        if desk.diagnosing is None:
            show(self.progress)
            return
        lines = desk.diagnosing.said
        said: list[str] = [listed([desk.outcome or desk.diagnosing.progress])]
        if found is not None:
            masked = " without the intervals that it masked" if found.left_out else ""
            names = " and ".join(found.effects) or "no effect"
            answer = ANSWER.format(Html("\n").join(found.text.splitlines()))
            said = [f"Error over noise with {names}: {found.over_noise:.2f}{masked}.", answer]
        elif desk.running:
            said.append(listed([f"best so far: {desk.diagnosing.best}"]))
        show(self.progress, *said, FOLDED.format(f"{len(lines)} steps", listed(lines)))

    def _show_model(self, bench: Workbench) -> None:
        names = [trial.name for trial in bench.recording.trials]
        trials = [name for name in names if name in bench.never_fitted]
        others = [name for name in names if name not in trials]
        choose(self.trial, [(name, f"{name} (never fitted)") for name in trials] + [(name, name) for name in others])
        joints = bench.recording.joints
        choose(self.joint, joints, "" if self.joint.value else joints[-1])
        choose(self.over, [*trials, *others])
        choose(self.other, [NONE, *(f"{k}: {one.label}" for k, one in enumerate(bench.stages[:-1]))])
        choose(self.present, bench.effects)
        self.remove.disabled = not bench.effects
        show(self.stairs, error_by_stage(bench))

    def _show_trial(self, bench: Workbench, joint: str) -> None:
        compared, beside = bench.comparison(self.trial.value), None
        if self.other.value != NONE:
            other = bench.stages[int(self.other.value.partition(":")[0])]
            beside = bench.simulate(self.trial.value, other.model).position
        others = [name for name in self.over.value if name != self.trial.value]
        over = [(bench.trial(one), bench.simulate(one).position) for one in others]
        self.time.show(compared, bench.recording.joints.index(joint), beside, over)
        unit = bench.recording.shown[joint]
        failing = sorted((one for one in compared.failing_intervals if one.joint == joint), key=lambda one: -one.error)
        intervals = [
            (f"{one.start}|{one.end}", f"{one.start:.2f} to {one.end:.2f} s: {milli(one.error, unit)}")
            for one in failing[:MOST]
        ]
        choose(self.where, [NONE, *intervals], NONE)
        show(self.sentences, error_of_trial(compared, joint))

    def _show_candidates(self, bench: Workbench, joint: str) -> None:
        groups = self.desk.looks.get(joint)
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
        choose(self.another, [NONE, *(name for name in every if name not in names)])
        reach = self.desk.explainable.get(joint)
        bound = "" if reach is None else f" Any law of the logged signals: {100 * reach:.0f} % of the missing torque."
        show(
            self.unseen,
            f"Part of the squared error on fitted trials that each takes away by itself.{bound}",
            FOLDED.format(f"{len(unseen)} cannot be seen", listed(f"{one.effect}: {one.why}" for one in unseen)),
        )

    def _show_card(self, bench: Workbench) -> None:
        """Show the chosen candidate's card, and the error that it would leave once that is known."""
        now, then, lines = bench.stage.over_noise, self.desk.promised, []
        if self.desk.chosen == f"{self.candidate}@{self.joint.value}":
            verdict = "would not get smaller" if then >= now else "would fall"
            lines = [f"error over noise {verdict}: {now:.2f} to {then:.2f}, before the rest is refitted"]
        show(self.card, card(self.candidate, *lines) if self.candidate else "")

    def _slider(self, one: Value) -> models.Slider:
        name = one.key.replace(f"@{self.joint.value}", "")
        found = " fixed" if one.fixed else "" if one.interval is None else " in [{:.4g}, {:.4g}]".format(*one.interval)
        low, high = one.unknown.low, one.unknown.high
        slider = models.Slider(
            start=low, end=high, value=one.value, step=(high - low) / 1000, sizing_mode="stretch_width",
            title=plain(f"{name} [{one.unit}]{found}", 3 * LABEL),
            format=models.PrintfTickFormatter(format="%.4g"),
        )  # fmt: skip
        slider.on_change("value", lambda attr, old, new: self._move(one, new))
        slider.on_change("value_throttled", lambda attr, old, new: self._set(one, new))
        return slider

    def _show_number(self) -> None:
        one = self.values.get(self.number.value)
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
        said = next_steps(proposed, bench.recording.units)
        show(self.proposal, listed(said), DOWNLOAD if proposed.decides else "")
        self.experiment.show(proposed, list(bench.recording.units.values()))
