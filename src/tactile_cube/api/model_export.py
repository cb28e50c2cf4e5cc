"""Write an identified model for another simulator, from a program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tactile_cube.api.comparison import opened
from tactile_cube.api.job import Job, PathLike, as_input_errors, called_job
from tactile_cube.drivetrain.model_file import Estimate, ModelFile, as_model
from tactile_cube.errors import InputError
from tactile_cube.identification.export.joint_drive import as_bam
from tactile_cube.identification.export.robot_file import as_mjcf, as_urdf
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.nominal import nominal_model, require_same_joints
from tactile_cube.untrusted_file import below
from tactile_cube.whole_file import write_whole

Format = Literal["mjcf", "urdf", "bam"]
ENDINGS = {"mjcf": "xml", "urdf": "urdf", "bam": "json"}


@dataclass(frozen=True)
class ModelExport:
    """A file for another simulator, and what its format cannot hold of the model, a line each."""

    output: Path
    not_held: list[str]

    @property
    def text(self) -> str:
        """What was written, and what is missing in it."""
        left = [f"  {line}" for line in self.not_held]
        return "\n".join([str(self.output), *(["the format cannot hold:", *left] if left else [])])


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
    if config.format not in ENDINGS:
        raise InputError(f"format={config.format}: choose one of {', '.join(ENDINGS)} for model={config.model}")
    if config.model is None and model is None:
        raise InputError(
            f"format={config.format}: give model=model.yaml of identify or diagnose; a policy has no format"
        )
    known = as_model(config.model if model is None else model)
    output = Path(config.output or f"{Path(known.rig).name or 'model'}.{ENDINGS[config.format]}")
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
    """The model with what only the recording states of constants."""
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
