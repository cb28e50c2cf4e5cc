"""Diagnose a recording from a program: which physical effect does the model lack?"""

import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from tactile_cube.api.comparison import modelled, opened_or_imported
from tactile_cube.api.job import Job, PathLike, Say, as_input_errors, called_job
from tactile_cube.drivetrain.effects import catalogue, find_effect
from tactile_cube.drivetrain.model_file import ModelFile, write_model
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.identification import ContactDiagnosis, diagnose_contact, with_contact
from tactile_cube.identification.criteria import Criteria
from tactile_cube.identification.diagnosis import Diagnosis, diagnose_recording, write_experiment
from tactile_cube.identification.diagnosis_json import as_json
from tactile_cube.identification.in_words import answer, restated
from tactile_cube.identification.model_files import model_file, stated_model
from tactile_cube.measurement.bench import has_free_motion, with_object, without_touches
from tactile_cube.measurement.comparing.comparison import compare_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import require_same_joints
from tactile_cube.whole_file import write_json, written_together

SHAPES = 3  # of the missing torque of one joint, best fit first


@dataclass(frozen=True)
class DiagnosisResult:
    """Verdict, its evidence, and the model with the effects that were found.

    Attributes:
        known: the model that it began with; None: what the recording states.
        free: the diagnosis of trials in free motion; None without such trials.
        contact: the diagnosis of trials in which the hand holds an object; None without such trials.
        data: the content of diagnosis.json: plain numbers, errors in rad.
    """

    recording: Recording
    known: ModelFile | None
    free: Diagnosis | None
    contact: ContactDiagnosis | None
    model: ModelFile
    data: dict[str, Any]
    job: Job

    @property
    def verdict(self) -> str:
        """`adequate`, `missing_effect`, `ambiguous`, `partly_explained` or `unknown_effect`."""
        return str(self.data["verdict"])

    @property
    def effects(self) -> list[str]:
        """What is missing, as `identify` takes it: NAME@JOINT, or NAME for effects of fingertips and object."""
        entries = [(entry["name"], joint) for entry in self.data["effects"] for joint in entry["joints"]]
        return [name if joint == "object" else f"{name}@{joint}" for name, joint in entries]

    @property
    def text(self) -> str:
        """The answer in plain words."""
        constants = restated(self.recording, self.model) if self.free else []
        units = {"shown_in": self.recording.shown}
        return answer(self.data | units, self.free.experiment if self.free else None, constants)

    def write(self, folder: PathLike, report: bool = True) -> None:
        """Write model.yaml, diagnosis.json and the next experiment; with `report`, report.html and diagnosis.rrd."""
        with written_together(Path(folder), "diagnosis.json") as aside:
            write_model(self.model, aside / "model.yaml")
            write_json(aside / "diagnosis.json", self.data)
            if self.free is not None:
                write_experiment(self.free, aside)
            if report:
                self._write_report(aside, str(Path(folder) / "model.yaml"))

    def _write_report(self, folder: Path, path: str) -> None:
        from tactile_cube.visualization.comparison_episode import write_comparison
        from tactile_cube.visualization.diagnosis_report import contact_diagnosis_report, diagnosis_report
        from tactile_cube.visualization.report import write_report

        config, found = self.job.config, self.free
        if found is None:
            page = contact_diagnosis_report(self.data, self.recording, self.job.command, path)
            return write_report(page, folder / "report.html")
        recording = without_touches(self.recording)
        before = compare_recording(recording, self.known, config.step, floor=found.floor)
        after = compare_recording(recording, self.model, config.step, floor=found.floor)
        write_comparison(after, folder / "diagnosis.rrd")
        shapes = [shape for one in found.unexplained for shape in one.shapes[:SHAPES]]
        page = diagnosis_report(self.data, before, after, self.job.command, path, shapes, found.experiment)
        return write_report(page, folder / "report.html")


@as_input_errors
def diagnose(
    recording: Recording | PathLike | None = None,
    *,
    source: str | None = None,
    model: ModelFile | PathLike | None = None,
    effects: Sequence[str] | None = None,
    criteria: str | None = None,
    step: float | None = None,
    seed: int | None = None,
    values: Mapping[str, Any] | None = None,
    say: Say | None = None,
) -> DiagnosisResult:
    """Find out which physical effect a model lacks, from a recording of the real mechanism.

    Args:
        recording: what was measured, or its folder; two or more trials.
        source: in its place, option of conf/source by which logs are imported into the run's folder.
        model: to begin with, or its file: what else is missing? None: what the recording states.
        effects: effects of your own beside the catalogue, as dotted paths.
        criteria: option of conf/criteria, what decides the answer.
        step: simulation step of the errors that are stated [s].
        seed: which trials are held out.
        values: other keys of the configuration, e.g. {"criteria.adequate": 1.5, "source.files": ["log.csv"]}.
        say: takes lines of progress; None: stderr.

    Raises:
        InputError: a recording, a model or an effect that cannot be used.

    Example:
        >>> found = tactile_cube.diagnose("my_recording")
        >>> print(found.text, found.verdict, found.effects)
        >>> found.write("outputs/my_diagnosis")
    """
    return run_diagnosis(called_job("diagnose", locals()), recording, model, say)


def run_diagnosis(
    job: Job, recording: Recording | PathLike | None, known: ModelFile | PathLike | None, say: Say | None = None
) -> DiagnosisResult:
    """Diagnose free motion, grasps, or both, as the recording has them."""
    say, known, recording = say or job.say, modelled(known), opened_or_imported(job, recording)
    if known is not None:
        require_same_joints(recording, known)
    if with_object(recording).trials and not has_free_motion(recording):
        return _of_grasps(job, recording, known, say)
    return _of_free_motion(job, recording, known, say)


def _of_grasps(job: Job, recording: Recording, known: ModelFile | None, say: Say) -> DiagnosisResult:
    config = job.config
    contact = diagnose_contact(recording, known, config.step, config.seed, say, Criteria(**config.criteria))
    model = stated_model(recording, job.command, config.seed)
    if known is not None:
        model = known.model_copy(update={"provenance": model.provenance})
    model = contact.into(model, alone=True)
    news = {one.effect for one in contact.effects()}
    data = contact.as_json()
    data["known_effects"] = [one.effect for one in model.effects if one.effect not in news]
    data["seconds"] = job.seconds
    return DiagnosisResult(recording, known, None, contact, model, data, job)


def _of_free_motion(job: Job, recording: Recording, known: ModelFile | None, say: Say) -> DiagnosisResult:
    config = job.config
    effects = tuple(dict.fromkeys([*catalogue().values(), *(find_effect(name) for name in config.effects)]))
    moving = without_touches(recording)
    criteria = Criteria(**config.criteria)
    found = diagnose_recording(moving, effects, config.step, config.seed, say, known, criteria)
    model = model_file(moving, found.fitted, found.errors(), [*found.held_out, *found.tested], job.command, config.seed)
    data = as_json(found, job.seconds, recording.units)
    if known is not None:
        model = model.model_copy(update={"effects": model.with_effects(known.object_effects)})
        data["known_effects"] += [one.effect for one in known.object_effects]
    contact = None
    if with_object(recording).trials:
        contact = diagnose_contact(recording, model, config.step, config.seed, say, criteria)
        model, data = contact.into(model, alone=False), with_contact(data, contact)
        data["seconds"] = job.seconds
    return DiagnosisResult(recording, known, found, contact, model, data, job)


T = TypeVar("T")
R = TypeVar("R")


def each(work: Callable[[T], R], over: Sequence[T], jobs: int = 1) -> Iterator[tuple[T, R]]:
    """Yield each item with the result of `work` for it, in the order in which they finish.

    Args:
        work: runs in other processes, so it, its argument and its result must be picklable.
        over: the arguments of `work`, one per call.
        jobs: number of processes.

    Raises:
        InputError: what `work` raises.
    """
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(work, one): one for one in over}
        for future in as_completed(futures):
            yield futures[future], future.result()


class Answered(NamedTuple):
    """What `diagnose` answered, in plain words and as diagnosis.json has it."""

    text: str
    data: dict[str, Any]


def diagnose_each(
    recordings: Sequence[PathLike], *, out: PathLike, jobs: int = 1, **settings: Any
) -> Iterator[tuple[Path, Answered | InputError]]:
    """Diagnose many recordings at once; the files of each go to a folder of its name in `out`.

    Args:
        recordings: folders, each with a name of its own.
        out: folder of the answers.
        jobs: see `each`.
        settings: of every diagnosis, see `diagnose`.

    Yields:
        Folder and answer, or what is wrong with the recording, in the order in which they are done.

    Raises:
        InputError: two recordings with one name.

    Example:
        >>> for folder, answer in tactile_cube.diagnose_each(["monday", "friday"], out="outputs/week", jobs=2):
        ...     print(folder, answer)
    """
    folders = {Path(folder).resolve().name: Path(folder) for folder in recordings}
    if len(folders) < len(recordings):
        raise InputError(f"recordings={[str(one) for one in recordings]}: give folders that differ in their last name")
    yield from each(partial(_diagnosed, settings, Path(out)), [*folders.values()], jobs)


def _diagnosed(settings: Mapping[str, Any], out: Path, folder: Path) -> Answered | InputError:
    try:
        found = diagnose(folder, **settings, say=lambda line: None)
    except InputError as error:
        return error
    found.write(out / folder.resolve().name)
    return Answered(found.text, found.data)
