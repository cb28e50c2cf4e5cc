"""What all windows of a workbench share: the state, the logs that wait to be imported, and what is running."""

import sys
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from glob import glob
from pathlib import Path
from threading import Thread
from typing import Any

from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2
from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Missing
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.usage_error import usage_error
from tactile_cube.workbench.background import Diagnosing, Found
from tactile_cube.workbench.importing import Preview, Waiting, import_logs, kept, settings_of
from tactile_cube.workbench.state import Look, Workbench

LABEL = 60  # characters of a wrong name that an error repeats


class Desk:
    """One state and one worker for all windows."""

    def __init__(self, folder: Path, own_effects: Sequence[str] = (), seed: int = 0, model: str | None = None) -> None:
        self.folder, self.own_effects, self.seed, self.model = folder, tuple(own_effects), seed, model
        self.bench: Workbench | None = None  # until a recording is loaded
        self.version, self.ended = 0, False  # version grows with every change of the model or the recording
        self.busy = self.problem = ""  # what is being done, and what went wrong last, in words
        self.notes: list[str] = []  # what was understood and what is odd, a line each
        self.waiting = Waiting()  # files that wait to be imported
        self.preview: Preview | None = None  # of the first
        self.diagnosing: Diagnosing | None = None  # that runs or ran last
        self.outcome = self.commands = ""  # how it ended, empty while it runs; the proposed experiment's file as text
        self.listeners: list[Callable[[], None]] = []
        self._worker, self._queued = ThreadPoolExecutor(1), 0
        self._forget()

    def _forget(self) -> None:
        """Clear the results that belong to a model no longer in use."""
        self.looks: dict[str, list[list[Look]]] = {}  # joint -> candidates, best first, those that look alike together
        self.explainable: dict[str, float] = {}  # joint -> part of the missing torque that any law could explain
        self.chosen, self.promised = "", 0.0  # candidate looked at, NAME@JOINT; error over noise that it would leave
        self.signature: Missing | None = None  # the torque that it would supply
        self.experiment: Experiment | None = None  # proposed

    def changed(self) -> None:
        """Notify every window."""
        for listener in list(self.listeners):
            listener()

    def say(self, words: str) -> None:
        """Show what is being done."""
        self.busy = words
        self.changed()

    def do(self, words: str, work: Callable[[], object], asked: bool = True) -> None:
        """Queue work for the background thread; an error is shown until the next work that a user asks for."""
        self._queued += asked

        def run() -> None:
            self._queued -= asked
            self.problem = "" if asked else self.problem
            self.say(words)
            try:
                work()
            except Exception as error:
                if self.ended:
                    return
                said = usage_error(error)
                if said is None:
                    traceback.print_exc(file=sys.stderr)
                    said = f"{type(error).__name__}: {error}; that is a defect of the workbench, see the terminal"
                self.problem = said.replace(f"{self.folder}/", "")
            self.say("")

        self._worker.submit(run)

    def beside(self, words: str, work: Callable[[Workbench], object], asked: bool = True) -> None:
        """Queue work on the workbench that will be loaded then, if there is one."""
        self.do(words, lambda: work(self.bench) if self.bench is not None else None, asked)

    def change(self, words: str, work: Callable[[Workbench], object]) -> None:
        """Change the model; afterwards everything that was seen beside the old one is forgotten."""

        def run(bench: Workbench) -> None:
            work(bench)
            self._renewed(bench)

        self.beside(words, run)

    def _renewed(self, bench: Workbench) -> None:
        self._forget()
        self.bench, self.version, self.notes = bench, self.version + 1, []

    def open(self, text: str) -> None:
        """Take what somebody named: a recording's folder, a model.yaml, logs (a pattern too) or a URDF."""

        def run() -> None:
            path = _path(text)
            if (path / DESCRIPTION).is_file():
                self._load(path)
            elif path.name.endswith((".yaml", ".yml")):
                read_model(path)
                self.model = str(path)
                if self.bench is not None:
                    self._load(self.bench.opened.folder)
            else:
                files = [Path(name) for name in sorted(glob(str(path)))]
                if not files:
                    raise InputError(f"{path}: no recording's folder (with {DESCRIPTION}) and no file")
                self._wait(self.waiting.with_files(files))

        self.do(f"opening {text}", run)

    def take(self, names: Sequence[str], contents: Sequence[bytes]) -> None:
        """Take files that were dropped onto the page."""

        def run() -> None:
            files = [kept(self.folder / "dropped", *one) for one in zip(names, contents, strict=True)]
            self._wait(self.waiting.with_files(files))

        self.do(f"reading {', '.join(names)}", run)

    def choose_robot(self, robot: str) -> None:
        """Take one joint of unknown lever in the place of a URDF."""
        self.do(f"a {robot}", lambda: self._wait(replace(self.waiting, urdf=None, robot=robot)))

    def _wait(self, waiting: Waiting) -> None:
        self.waiting, self.preview = waiting, None
        self.preview = waiting.preview()

    @property
    def same_rig(self) -> Recording | None:
        """The recording that is loaded, unless another rig's URDF was named since: what came back is added to it."""
        bench = self.bench
        return bench.opened if bench is not None and bench.opened.rig.path == self.waiting.urdf else None

    def import_waiting(self, typed: dict[str, str], columns: dict[str, Any], together: bool = False) -> None:
        """Import the logs that wait and load what they make; they wait on where something is wrong.

        `typed`: settings of `record source=csv` such as "controller.kp"; `columns`: as `source.columns`, none: as
        guessed; `together`: with the trials of the recording that is loaded, if the URDF is its own.
        """
        waiting, before = self.waiting, self.same_rig if together else None

        def run() -> None:
            given = settings_of(typed) | waiting.settings | {"columns": columns or None}
            if waiting.lacks:
                raise InputError(f"still needed: {' and '.join(waiting.lacks)}")
            recording, understood = import_logs(self._place("recording"), given, before)
            self._load(recording.folder)
            self.notes = [*understood, *self.notes]

        self.do("importing", run)

    def _place(self, what: str) -> Path:
        """Return a folder that does not exist yet."""
        return self.folder / f"{what}_{self.version}_{len(list(self.folder.glob(f'{what}_*')))}"

    def _load(self, folder: Path) -> None:
        self.stop()
        bench = Workbench(folder, self.model, self.own_effects, self.seed, self.say)
        self.diagnosing, self.outcome = None, ""
        self._renewed(bench)
        warnings = [line.replace(f"{folder / DESCRIPTION}: ", "") for line in bench.opened.warnings]
        self.notes = [f"warning: {line}" for line in warnings]
        self.waiting, self.preview = Waiting(urdf=bench.opened.rig.path), None

    def look(self, joint: str) -> None:
        """Evaluate the candidates of a joint, unless that was done."""

        def work(bench: Workbench) -> None:
            if joint not in bench.recording.joints or joint in self.looks:
                return
            found = bench.candidates(joint, stop=lambda: self._queued > 0)
            if found is None:
                self.look(joint)  # again, after the work that a user waits for
            else:
                self.explainable[joint] = bench.explainable(joint)
                self.looks[joint] = found

        self.beside(f"looking at what may be missing at {joint}", work, asked=False)

    def draw(self, look: Look, label: str) -> None:
        """Find the torque that a candidate would supply, and what it would leave."""
        version = self.version

        def work(bench: Workbench) -> None:
            if version == self.version:
                self.signature, self.promised = bench.signature(look), bench.promised(look)
                self.chosen = label

        self.beside(f"what {label} would supply", work)

    @property
    def running(self) -> bool:
        """Whether a diagnosis runs."""
        return self.diagnosing is not None and not self.outcome

    @property
    def found(self) -> Found | None:
        """The answer of the last diagnosis."""
        return self.diagnosing.found if self.diagnosing is not None and self.outcome else None

    def diagnose(self) -> None:
        """Start a diagnosis beside the model in force."""

        def work(bench: Workbench) -> None:
            if not self.running:
                folder = self._place("diagnosis")
                folder.mkdir(parents=True)
                self.diagnosing, self.outcome = bench.diagnose(folder), ""
                Thread(target=self._watch, args=(self.diagnosing,), daemon=True).start()

        self.beside("starting a diagnosis", work)

    def _watch(self, running: Diagnosing) -> None:
        try:
            for _ in running.lines():
                self.changed()
            outcome = "stopped" if running.found is None else "done"
        except InputError as error:
            outcome = str(error)
        if self.diagnosing is running:
            self.outcome = outcome
        self.changed()

    def stop(self) -> None:
        """Stop the diagnosis that runs."""
        if self.diagnosing is not None:
            self.diagnosing.stop()

    def end(self) -> None:
        """Stop the diagnosis that runs; what else is being done ends with the program."""
        self.ended = True
        self.stop()

    def propose(self) -> None:
        """Find the commands that would show whether the last effect is there."""

        def work(bench: Workbench) -> None:
            self.experiment = bench.propose()
            self.folder.mkdir(parents=True, exist_ok=True)
            self.commands = self.experiment.write(self.folder).read_text(encoding="utf-8")

        self.beside("looking for commands that decide, within the limits", work)

    def save(self, folder: str) -> None:
        """Write model.yaml and report.html."""

        def work(bench: Workbench) -> None:
            path = _path(folder)
            bench.save(path)
            self.notes = [f"saved {path / 'model.yaml'} and report.html"]
            if _is_hand(bench.recording.joints):
                self.notes += [f"train in it: python -m tactile_cube.train +experiment=adapt model={path}/model.yaml"]

        self.beside("saving", work)


def _path(text: str) -> Path:
    try:
        path = Path(text.strip()).expanduser()
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return path
    except (OSError, RuntimeError, ValueError) as error:  # a NUL, 10 000 characters, the home of an unknown user
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{text[:LABEL]!r}: no name of a file here: {reason}; type another one") from None
    return path


def _is_hand(joints: Sequence[str]) -> bool:
    """Return whether these are all joints of the hand that is trained, or those of one of its fingers."""
    hand = DLR_HAND2.joint_names
    known = [one for joint in joints for one in hand if one == joint or one.endswith(f"_{joint}")]
    return sorted(known) == sorted(hand)
