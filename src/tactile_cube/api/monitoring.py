"""Watch a machine from a program: what has changed since its model was identified?"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_cube.api.comparison import opened
from tactile_cube.api.diagnosis import DiagnosisResult, diagnose
from tactile_cube.api.identification import IdentificationResult, identify
from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.model_file import ModelFile, as_model, write_model
from tactile_cube.errors import InputError
from tactile_cube.identification.identification import judge_known
from tactile_cube.identification.model_files import Drift, changed, drifts
from tactile_cube.identification.search.evidence import worse
from tactile_cube.measurement.bench import without_touches
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import require_same_joints
from tactile_cube.whole_file import write_json, written_together


@dataclass(frozen=True)
class MonitorResult:
    """Changes of a machine since its model was identified.

    Attributes:
        before: the reference model.
        refitted: the same effects fitted to the newest recording.
        drifts: every parameter of both models, the least probable difference first.
        changed: the significant ones, if the held-out trials reject the old values.
        errors: held-out error over the sensor noise: `before`, of the reference on its own recording; `as_before`, of
            the reference on the newest; `now`, of the refitted model there.
        missing: whether the refitted model has become so much worse that something new is missing.
        diagnosis: names it, where that was asked for.
    """

    before: ModelFile
    refitted: IdentificationResult
    drifts: list[Drift]
    changed: list[Drift]
    errors: dict[str, float]
    missing: bool
    diagnosis: DiagnosisResult | None
    job: Job

    @property
    def alarm(self) -> bool:
        """Whether anything has changed."""
        return bool(self.changed) or self.missing

    @property
    def text(self) -> str:
        """What has changed, in words."""
        then, now = self.errors["before"], self.errors["now"]
        lines = [f"changed: {_described(one)}" for one in self.changed]
        if self.missing:
            lines.append(f"something new is missing: error {now:.2f} times the sensor noise, {then:.2f} times before")
        if not lines:
            kept = self.errors["as_before"]
            lines.append(
                f"nothing has changed: error {kept:.2f} times the sensor noise with the {len(self.drifts)} numbers as "
                f"they were, {now:.2f} refitted"
            )
        return "\n".join([*lines, *([self.diagnosis.text] if self.diagnosis else [])])

    @property
    def data(self) -> dict[str, Any]:
        """The content of monitor.json: plain numbers."""
        rows = {
            one.name: {"before": one.before.model_dump(), "now": one.now.model_dump()}
            | {key: getattr(one, key) for key in ("difference", "half_width", "p_value")}
            | {"changed": one in self.changed}
            for one in self.drifts
        }
        return {
            "alarm": self.alarm,
            "missing": self.missing,
            "error_over_noise": self.errors,
            "named": self.diagnosis.effects if self.diagnosis else None,
            "command": self.job.command,
            "seconds": self.job.seconds,
            "numbers": rows,
        }

    def write(self, folder: PathLike) -> None:
        """Write monitor.json and model.yaml, the refitted model; with a diagnosis its files in diagnosis/."""
        folder = Path(folder)
        if self.diagnosis is not None:
            self.diagnosis.write(folder / "diagnosis")
        with written_together(folder, "monitor.json") as aside:
            write_json(aside / "monitor.json", self.data)
            write_model(self.refitted.model, aside / "model.yaml")


@as_input_errors
def monitor(
    recording: Recording | PathLike,
    model: ModelFile | PathLike,
    *,
    own_effects: Sequence[str] | None = None,
    last: int | None = None,
    significance: float | None = None,
    growth: float | None = None,
    name_it: bool | None = None,
    step: float | None = None,
    seed: int | None = None,
    say: Say | None = None,
) -> MonitorResult:
    """Find out whether a machine has changed since its model was identified.

    Args:
        recording: the newest, or its folder; two or more trials.
        model: of `identify` or `diagnose` on an earlier recording of the same machine, or its file.
        own_effects: classes of your own that the model names, as dotted paths.
        last: only so many trials of the recording's end; None: all.
        significance: of a change, for all numbers together.
        growth: alarm where the refitted model's error over the sensor noise grew by this factor.
        name_it: diagnose after an alarm, to name what is missing.
        step: simulation step of the errors that are stated [s].
        seed: which trials are held out.
        say: takes lines of progress; None: stderr.

    Raises:
        InputError: a recording or a model that cannot be used, or that are not of the same joints.

    Example:
        >>> seen = tactile_cube.monitor("log_of_today", "last_week/model.yaml")
        >>> print(seen.alarm, seen.text)
    """
    return run_monitor(called_job("monitor", locals()), recording, model, say)


def run_monitor(
    job: Job, recording: Recording | PathLike, model: ModelFile | PathLike, say: Say | None = None
) -> MonitorResult:
    """Refit the reference's effects on the newest recording, and compare parameters and errors.

    Numbers that trade places with each other differ from recording to recording by more than their intervals say; a
    machine that has changed is not followed any more by the numbers as they were.
    """
    config, say = job.config, say or job.say
    before, recording = as_model(model), opened(recording)
    then = before.errors.over_noise
    if then is None:
        raise InputError(
            f"model of {before.rig}: errors.over_noise is missing; take the model.yaml that identify or diagnose wrote"
        )
    require_same_joints(recording, before)
    effects = [one.effect for one in before.drive_effects]
    resolve(effects, recording.joints)  # before they are named as if by the user, whose own are imported
    if config.last is not None and not (isinstance(config.last, int) and config.last >= 2):
        raise InputError(f"last={config.last}: give at least 2 trials, of which one is held out, or null for all")
    newest = recording if config.last is None else recording.with_trials(recording.trials[-config.last :])
    refitted = identify(newest, effects, step=config.step, seed=config.seed, say=say)
    assert refitted.free is not None  # it was asked for effects of the drive
    now, kept = refitted.free.judgement, judge_known(without_touches(newest), before, config.seed)
    found = drifts(before, refitted.model)
    gone = changed(found, config.significance) if worse(kept, now) else []
    missing = now.error > config.growth * max(then, 1.0)
    errors = {"before": then, "as_before": kept.error, "now": now.error}
    named = None
    if config.name_it and (gone or missing):
        named = diagnose(newest, model=before, step=config.step, seed=config.seed, say=say)
    return MonitorResult(before, refitted, found, gone, errors, missing, named, job)


def _described(one: Drift) -> str:
    unit = f" {one.now.unit}" if one.now.unit else ""
    moved = f"{one.before.value:.4g} -> {one.now.value:.4g}{unit}"
    return f"{one.name}: {moved} ({one.difference:+.2g} +- {one.half_width:.2g}, p = {one.p_value:.1g})"
