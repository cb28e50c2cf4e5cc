"""Make recordings, and compare one with a model, from a program."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from omegaconf import OmegaConf
from pydantic import Field

from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.drivetrain.model_file import Estimate, ModelFile, Strict, as_model
from tactile_cube.errors import InputError, warn
from tactile_cube.identification.contact.grasps import compare_contact
from tactile_cube.measurement.bench import has_free_motion, with_object, without_touches
from tactile_cube.measurement.comparing.comparison import USUAL_STEP, Comparison, compare_recording, comparison_json
from tactile_cube.measurement.recordings.description import NotNegative
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import require_free, write_recordings
from tactile_cube.measurement.sources.source import recording_tables
from tactile_cube.whole_file import write_json, written_together


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
    """Return the recording, or import the logs of a job's source into its folder and return the result.

    Raises:
        InputError: neither of them is given, or both are.
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


@dataclass(frozen=True)
class ComparisonResult:
    """Deviation of a model from a measurement; `comparison` has errors by joint, trial and regime."""

    comparison: Comparison
    job: Job
    seconds: float

    @property
    def error(self) -> float:
        """RMS position error over all joints [rad]."""
        return self.comparison.errors.overall

    @property
    def noise_floor(self) -> float:
        """Error that a perfect model would leave [rad]."""
        return self.comparison.floor.overall

    @property
    def text(self) -> str:
        """The result in words: overall, by joint, and where the model fails."""
        from tactile_cube.visualization.comparison_report import summary

        return summary(self.comparison)

    @property
    def data(self) -> dict[str, Any]:
        """The content of comparison.json: plain numbers, errors in rad."""
        config = self.job.config
        origin = {"model": config.model, "command": self.job.command}
        return comparison_json(self.comparison) | origin | {"seconds": self.seconds}

    def write(self, folder: PathLike, rerun: bool = True) -> None:
        """Write comparison.json, report.html and, with `rerun`, comparison.rrd."""
        from tactile_cube.visualization.comparison_report import comparison_report
        from tactile_cube.visualization.report import write_report

        with written_together(Path(folder), "comparison.json") as aside:
            write_json(aside / "comparison.json", self.data)
            page = comparison_report(self.comparison, self.job.command, self.job.config.model)
            write_report(page, aside / "report.html")
            if rerun:
                from tactile_cube.visualization.comparison_episode import write_comparison

                write_comparison(self.comparison, aside / "comparison.rrd")


@as_input_errors
def compare(
    recording: Recording | PathLike,
    *,
    model: ModelFile | PathLike | None = None,
    gain: float | None = None,
    own_effects: Sequence[str] | None = None,
    step: float | None = None,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    say: Say | None = None,
) -> ComparisonResult:
    """Simulate a recording's commands and say how far model and measurement are apart, and where.

    Args:
        recording: what was measured, or its folder.
        model: of `identify` or `diagnose`, or its file; None: the values that the recording states.
        gain: P gain of the controller in this recording over that at which the model was identified.
        own_effects: classes of your own that the model names, as dotted paths.
        step: of the simulation [s]; None: as fine as the sensors need.
        seed: of the randomised simulations.
        values: other keys of conf/compare.yaml, e.g. {"band.simulations": 0}.
        say: takes lines of progress; None: stderr.

    Raises:
        InputError: a recording or a model that cannot be used.

    Example:
        >>> result = tactile_cube.compare("my_recording", model="model.yaml")
        >>> print(f"{1e3 * result.error:.2f} mrad, noise floor {1e3 * result.noise_floor:.2f} mrad")
    """
    return run_comparison(called_job("compare", locals()), recording, model, say)


class BandSettings(Strict):
    """Band of randomised simulations: their number, and how far their constants spread."""

    simulations: Annotated[int, Field(ge=0)]
    spread: dict[str, NotNegative]


def run_comparison(
    job: Job, recording: Recording | PathLike, model: ModelFile | PathLike | None, say: Say | None = None
) -> ComparisonResult:
    """Run a comparison: on free motion, or on grasps if the recording has nothing else."""
    config, say = job.config, say or job.say
    model, recording = _at_gain(modelled(model), config.gain), opened(recording)
    held = len(with_object(recording).trials)
    if held and not has_free_motion(recording):
        compared = compare_contact(recording, model, config.step or USUAL_STEP, say)
        return ComparisonResult(compared, job, job.seconds)
    if held:
        say(f"{held} trials with an object are left out here; diagnose and identify use them")
    band = BandSettings.model_validate(OmegaConf.to_container(config.band))
    randomised = (band.simulations, band.spread, config.seed)
    compared = compare_recording(without_touches(recording), model, config.step, *randomised)
    return ComparisonResult(compared, job, job.seconds)


def _at_gain(model: ModelFile | None, gain: Any) -> ModelFile | None:
    """Return the model with its position gain times `gain`; the servo's other constants do not change."""
    if not (isinstance(gain, int | float) and 0.0 < gain < math.inf):
        raise InputError(f"gain={gain}: give the P gain over that at which the model was identified, a number above 0")
    if gain == 1.0:
        return model
    if model is None or "kp" not in model.values:
        raise InputError(f"gain={gain}: give model=model.yaml with a kp; without one recording.yaml states the gain")
    kp = {
        joint: Estimate(value=gain * one.value, low=gain * one.low, high=gain * one.high, unit=one.unit)
        for joint, one in model.values["kp"].items()
    }
    return model.model_copy(update={"values": model.values | {"kp": kp}})


def opened(recording: Recording | PathLike) -> Recording:
    """Return the recording, read if it is a folder's name; its warnings go to stderr."""
    if isinstance(recording, Recording):
        return recording
    read = read_recording(str(recording))  # on the command line 2026 is a number
    for line in read.warnings:
        warn(line)
    return read


def modelled(model: ModelFile | PathLike | None) -> ModelFile | None:
    """Return the model, read if it is a file's name."""
    return None if model is None else as_model(model)
