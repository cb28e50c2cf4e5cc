"""Identify effects from a program: fit them, with intervals, and write the model for other simulators."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from tactile_cube.api.comparison import opened
from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.drivetrain.model_file import Estimate, ModelFile, as_model, write_model
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.identification import ContactIdentification, contact_effects, identify_contact
from tactile_cube.identification.export import as_bam, as_mjcf, as_urdf
from tactile_cube.identification.identification import Identification, identify_effects
from tactile_cube.identification.in_words import errors_by_stage
from tactile_cube.identification.model_files import model_file, stated_model
from tactile_cube.measurement.bench import has_free_motion, touch_offsets, without_touches
from tactile_cube.measurement.comparing.comparison import compare_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model, require_same_joints
from tactile_cube.untrusted_file import below
from tactile_cube.whole_file import write_json, write_whole, written_together


@dataclass(frozen=True)
class IdentificationResult:
    """A fitted model, and the error after each stage.

    Attributes:
        free: the fit of trials in free motion; None without such trials.
        contact: the fit of trials in which the hand holds an object; None without effects of fingertips and object.
        data: the content of identification.json: plain numbers, errors in rad.
    """

    recording: Recording
    free: Identification | None
    contact: ContactIdentification | None
    model: ModelFile
    data: dict[str, Any]
    job: Job

    @property
    def errors(self) -> dict[str, float]:
        """Held-out RMS position error after each stage, from `nominal` on, and `noise_floor` [rad]."""
        return dict(self.data["error"])

    @property
    def text(self) -> str:
        """The error after each stage, and the values with their intervals."""
        lines = [errors_by_stage(self.data["error"], self.model, self.recording.shown)]
        for parameter in self.contact.silent if self.contact else []:
            lines.append(f"warning: {parameter}: no trial shows it; its interval is the whole range that was searched")
        return "\n".join(lines)

    def write(self, folder: PathLike) -> None:
        """Write model.yaml, identification.json, report.html and, of free motion, identification.rrd."""
        from tactile_cube.visualization.diagnosis_report import contact_report
        from tactile_cube.visualization.report import write_report

        path = str(Path(folder) / "model.yaml")
        with written_together(Path(folder), "identification.json") as aside:
            write_model(self.model, aside / "model.yaml")
            write_json(aside / "identification.json", self.data)
            if self.free is not None:
                write_report(self._free_page(aside, path, self.free), aside / "report.html")
            elif self.contact is not None:
                page = contact_report(self.contact, self.recording, self.job.command, path)
                write_report(page, aside / "report.html")

    def _free_page(self, folder: Path, path: str, found: Identification) -> Any:
        from tactile_cube.visualization.comparison_episode import write_comparison
        from tactile_cube.visualization.diagnosis_report import held_section, identification_report

        config, recording = self.job.config, without_touches(self.recording)
        after = compare_recording(recording, self.model, config.step, floor=found.floor)
        write_comparison(after, folder / "identification.rrd")
        held = [held_section(self.contact.errors, self.contact.joint_errors, recording.shown)] if self.contact else []
        stages, joints = self.data["error"], self.data["joints"]
        return identification_report(after, stages, joints, self.job.command, path, held)


@as_input_errors
def identify(
    recording: Recording | PathLike,
    effects: Sequence[str],
    *,
    step: float | None = None,
    seed: int | None = None,
    say: Say | None = None,
) -> IdentificationResult:
    """Fit a rig's constants and exactly the effects that you name.

    Args:
        recording: what was measured, or its folder; two or more trials.
        effects: NAME@JOINT, NAME (every joint), a dotted path to a class of your own, or an effect of fingertips and
            object where the hand holds something.
        step: simulation step of the errors that are stated [s].
        seed: which trials are held out.
        say: takes lines of progress; None: stderr.

    Raises:
        InputError: a recording that cannot be used, an unknown effect or joint.

    Example:
        >>> fitted = tactile_cube.identify("my_recording", ["stribeck_friction@q3"])
        >>> print(fitted.text, fitted.model.effects)
        >>> fitted.write("outputs/my_model")
    """
    return run_identification(called_job("identify", locals()), recording, say)


def run_identification(job: Job, recording: Recording | PathLike, say: Say | None = None) -> IdentificationResult:
    """Fit what a job names: effects of the drivetrain, of fingertips and object, or both."""
    say, recording = say or job.say, opened(recording)
    contact = contact_effects(job.config.effects, recording)
    names = [effect.name for effect in contact]
    drive = [name for name in job.config.effects if name not in names]
    if contact and not drive and not has_free_motion(recording):
        return _of_grasps(job, recording, contact, say)
    return _of_free_motion(job, recording, drive, contact, say)


def _of_grasps(job: Job, recording: Recording, effects: list[Any], say: Say) -> IdentificationResult:
    config = job.config
    found = identify_contact(recording, effects, None, config.step, config.seed, say)
    model = found.into(stated_model(recording, job.command, config.seed), alone=True)
    contact = found.as_json()
    data = {key: contact[key] for key in ("error", "joints", "held_out")}
    data |= {"model": model.model_dump(), "contact": contact, "seconds": job.seconds}
    return IdentificationResult(recording, None, found, model, data, job)


def _of_free_motion(
    job: Job, recording: Recording, drive: list[str], effects: list[Any], say: Say
) -> IdentificationResult:
    config = job.config
    moving = without_touches(recording)
    found = identify_effects(moving, drive, config.step, config.seed, say)
    model = model_file(moving, found.fitted, found.errors(), found.held_out, job.command, config.seed)
    model = model.model_copy(update={"offsets": model.offsets | touch_offsets(recording, model)})
    contact = identify_contact(recording, effects, model, config.step, config.seed, say) if effects else None
    model = model if contact is None else contact.into(model, alone=False)
    stages = {name: summary.overall for name, summary in found.stages.items()} | {"noise_floor": found.floor.overall}
    joints = {name: summary.joints for name, summary in found.stages.items()}
    data = {"error": stages, "joints": joints, "held_out": found.held_out, "model": model.model_dump()}
    data |= {} if contact is None else {"contact": contact.as_json()}
    data["seconds"] = job.seconds
    return IdentificationResult(recording, found, contact, model, data, job)


Format = Literal["mjcf", "urdf", "bam"]
ENDINGS = {"mjcf": "xml", "urdf": "urdf", "bam": "json"}


class ModelExport(NamedTuple):
    """A file for another simulator, and what its format cannot hold of the model, a line each."""

    output: Path
    not_held: list[str]

    @property
    def text(self) -> str:
        """What was written, and what is missing in it."""
        left = ["the format cannot hold:", *(f"  {line}" for line in self.not_held)] if self.not_held else []
        return "\n".join([str(self.output), *left])


@as_input_errors
def export_model(
    model: ModelFile | PathLike,
    format: Format,
    output: PathLike | None = None,
    *,
    recording: Recording | PathLike | None = None,
    values: Mapping[str, Any] | None = None,
) -> ModelExport:
    """Write a model as MJCF, as URDF or as a parameter file of BAM.

    Args:
        model: as identified, or its file.
        format: of the file.
        output: file to write; None: named after the rig, in the working directory.
        recording: the model's, for its rig; None: the one that the model names. BAM needs none.
        values: other keys of conf/export.yaml, e.g. {"bam.actuator": "sts3215"}.

    Raises:
        InputError: no such format, a recording of another rig or none, a joint that BAM is not told.

    Example:
        >>> print(tactile_cube.export_model("outputs/fit/model.yaml", "mjcf").text)
    """
    return run_model_export(called_job("export", locals()), model, recording)


def run_model_export(
    job: Job, model: ModelFile | PathLike | None = None, recording: Recording | PathLike | None = None
) -> ModelExport:
    """Write the file of a job."""
    config = job.config
    if config.policy is not None:
        raise InputError(f"policy={config.policy}: format={config.format} is of a model; leave one of them out")
    if config.format not in ENDINGS:
        raise InputError(f"format={config.format}: choose one of {', '.join(ENDINGS)} for model={config.model}")
    if config.model is None and model is None:
        raise InputError(
            f"format={config.format}: give model=model.yaml of identify or diagnose; a policy has no format"
        )
    known = as_model(config.model if model is None else model)
    output = Path(config.output or f"{Path(known.rig).name or 'model'}.{ENDINGS[config.format]}")
    if output.is_dir():
        raise InputError(f"output={output}: is a folder; name a file")
    if config.format == "bam":
        text, left = as_bam(known, config.bam.joint, config.bam.actuator, config.bam.volts)
    else:
        rig = _rig(known, config.recording if recording is None else recording)
        require_same_joints(rig, known)
        known = _with_stated(known, rig)
        text, left = as_mjcf(known, rig) if config.format == "mjcf" else as_urdf(known, rig)
    output.parent.mkdir(parents=True, exist_ok=True)
    write_whole(output, text.encode())
    return ModelExport(output, left)


def _with_stated(model: ModelFile, recording: Recording) -> ModelFile:
    """Return the model with the constants added that only the recording states."""
    rows = {
        key: {joint: Estimate.model_validate(float(value)) for joint, value in zip(recording.joints, row, strict=True)}
        for key, row in nominal_model(recording, model).constants.items()
    }
    return model.model_copy(update={"values": {key: row | model.values.get(key, {}) for key, row in rows.items()}})


def _rig(model: ModelFile, recording: Recording | PathLike | None) -> Recording:
    if recording is not None:
        return opened(recording)
    named = model.provenance.recording
    try:  # a file may name any folder: one of the user's own, at most
        folder = below(Path.cwd(), named, "model: provenance.recording")
    except InputError as error:
        raise InputError(f"{error}; or give recording=FOLDER") from None
    if not named or not folder.is_dir():
        raise InputError(f"model: its recording '{named}' is not here; give recording=FOLDER, which has the rig")
    return opened(folder)
