"""Many calls at once, in processes of this machine."""

import multiprocessing
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from tactile_cube.api.comparison import opened
from tactile_cube.api.diagnosis import diagnose
from tactile_cube.api.job import PathLike
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.whole_file import write_whole, written_together

T = TypeVar("T")
R = TypeVar("R")


def each(work: Callable[[T], R], over: Sequence[T], jobs: int = 1) -> Iterator[tuple[T, R]]:
    """What `work` makes of each, in the order in which it is done.

    Args:
        work: runs in other processes, so it and what it takes and gives can be pickled.
        over: what it is given, one each.
        jobs: processes.

    Raises:
        InputError: what `work` raises.
    """
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(work, one): one for one in over}
        for future in as_completed(futures):
            yield futures[future], future.result()


class Answered(NamedTuple):
    """What `diagnose` answered, in plain words and as diagnosis.json has it, and the files that it writes."""

    text: str
    data: dict[str, Any]
    files: dict[str, bytes]


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
    sound: list[tuple[str, Recording]] = []
    for name, folder in folders.items():
        try:
            sound.append((name, opened(folder)))
        except InputError as error:
            yield folder, error
    for (name, _), found in each(partial(_diagnosed, settings, Path(out)), sound, jobs):
        if isinstance(found, InputError):
            yield folders[name], found
            continue
        with written_together(Path(out) / name, "diagnosis.json") as aside:
            for file, content in found.files.items():
                write_whole(aside / file, content)
        yield folders[name], found


def _diagnosed(settings: Mapping[str, Any], out: Path, named: tuple[str, Recording]) -> Answered | InputError:
    name, recording = named
    try:
        found = diagnose(recording, **settings, say=lambda line: None)
    except InputError as error:
        return error
    with tempfile.TemporaryDirectory() as place:
        found.write(place)
        files = {path.name: path.read_bytes() for path in Path(place).iterdir()}
    # its commands name the model where it will be
    files["report.html"] = files["report.html"].replace(place.encode(), str(out / name).encode())
    return Answered(found.text, found.data, files)
