"""Make recordings from a program: from a simulated rig, from files of other programs, from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from tactile_cube.api.comparison import opened
from tactile_cube.api.job import Job, PathLike, as_input_errors, called_job
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import require_free, write_recordings
from tactile_cube.measurement.sources.source import recording_tables


@as_input_errors
def record(
    out: PathLike, *, source: str | None = None, seed: int | None = None, values: Mapping[str, Any] | None = None
) -> dict[str, Recording]:
    """Write a recording from a source of conf/source, and read it back as every command would.

    Args:
        out: folder to write.
        source: option of conf/source.
        seed: of everything random.
        values: keys of the source, e.g. {"source.hidden": ["backlash@q2: play=0.03"]}.

    Returns:
        Sub-folder of `out` -> recording: "" is the recording itself, "validation" what identification must not see.

    Raises:
        InputError: `out` holds a recording already, or a file that cannot be used.

    Example:
        >>> measured = tactile_cube.record("made", source="finger", values={"source.hidden": ["backlash@q2"]})[""]
    """
    return run_recording(called_job("record", locals()))


def run_recording(job: Job) -> dict[str, Recording]:
    """Write what a job's source gives."""
    return _imported(job, Path(job.config.out))


def opened_or_imported(job: Job, recording: Recording | PathLike | None) -> Recording:
    """The recording, or what a job's source of logs gives, which is written into its folder.

    Raises:
        InputError: neither of them, or both.
    """
    if (recording is None) == (job.config.get("source") is None):
        raise InputError(
            "give either recording=FOLDER (of a recording.yaml) or logs to import: source=csv source.files=LOGS "
            "source.urdf=FILE"
        )
    return _imported(job, job.folder / "recording")[""] if recording is None else opened(recording)


def _imported(job: Job, out: Path) -> dict[str, Recording]:
    require_free(out)
    settings: Any = OmegaConf.to_container(job.config.source, resolve=True)
    tables = recording_tables(settings, str(job.choices["source"]), job.config.seed)
    write_recordings(out, tables)
    return {name: read_recording(out / name) for name in tables}
