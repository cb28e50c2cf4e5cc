"""What every source of recordings gives."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache
from typing import Any, Protocol, TypeVar

import numpy as np
from hydra.utils import get_class
from numpy.typing import NDArray
from omegaconf import OmegaConf
from pydantic import TypeAdapter, ValidationError

from tactile_cube.composition import CONFIG, composed, suggestion
from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.description import Description, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables

Value = TypeVar("Value")
PLACEHOLDER = [TrialEntry(file="none")]


class Source(Protocol):
    """Makes recordings."""

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Return sub-folder -> recording; `""` is the recording, `validation` what identification must not see."""
        ...


def described(**values: object) -> Description:
    """Build a checked description whose trials are added later from the tables."""
    return Description.model_validate({"format": 1, "trials": PLACEHOLDER} | values)


def with_stated(
    said: Mapping[str, Value | None], stated: Mapping[str, Mapping[str, float]], joints: Sequence[str]
) -> dict[str, Any]:
    """Merge the user's values over those in the rig's file for all joints; an infinite limit overrides no other."""
    of_file = {key: {joint: row[joint] for joint in joints} for key, row in stated.items() if row.keys() >= set(joints)}
    given = {key: value for key, value in said.items() if value is not None}
    return of_file | {key: value for key, value in given.items() if value != float("inf") or key not in of_file}


def listed(files: str | Iterable[str]) -> list[str]:
    """Return one file or several as a list."""
    return [files] if isinstance(files, str) else [str(one) for one in files]


REGULAR = 0.1  # part of a step by which those of a log at one rate differ
HIDDEN = 0.01  # of a step: what the last row of a log may be off by a rounded rate


def rate_of(time: NDArray[np.float64], digits: int, where: str) -> float:
    """Return the samples per second of rows at times (samples,) [s] of the file `where`, rounded if no row shows it.

    Where the steps are regular, their number over the whole time: a clock that counts from 1970 tells a step of some
    milliseconds to 0.2 us only. Else the median's, for a log with pauses has no other.

    Raises:
        InputError: time does not go forward.
    """
    steps = np.diff(time)
    step = float(np.median(steps)) if len(time) > 1 else float("nan")
    exact = 1.0 / step if step > 0 else 0.0
    if not 0 < exact < float("inf"):
        raise InputError(f"{where}: the rows are {step:g} s apart in the median; time must go forward by a fixed step")
    count = np.round(steps / step)
    if np.quantile(np.abs(steps / step - count), 0.95) < REGULAR:
        exact = float(count.sum() / (time[-1] - time[0]))
        rounded = float(np.round(exact, digits))
        return rounded if abs(rounded - exact) * (time[-1] - time[0]) < HIDDEN else exact
    return float(np.round(exact, digits))


def source_settings(option: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of `record source=OPTION`, overridden by those given, which Hydra does not interpret."""
    settings = dict(_shipped(option))
    for key, value in given.items():
        old = settings.get(key)
        settings[key] = {**old, **value} if isinstance(old, dict) and isinstance(value, Mapping) else value
    return settings


@cache
def _shipped(option: str) -> dict[str, Any]:
    return dict(OmegaConf.to_container(composed("record", [f"source={option}"]).source))  # type: ignore[arg-type]


def recording_tables(settings: Mapping[str, Any], option: str, seed: int) -> dict[str, RecordingTables]:
    """Make recordings from a source's settings, as the command, the workbench and programs do.

    Args:
        settings: of conf/source, whole; `_target_` is their source's class.
        option: its name in conf/source.
        seed: of simulated ones.

    Raises:
        InputError: settings that are missing, of another type or that the source does not have, and what the source
            itself refuses.
    """
    source = get_class(settings["_target_"])
    given = {key: value for key, value in settings.items() if key != "_target_" and value != "???"}
    known = [one.name for one in fields(source)]
    for key in given.keys() - set(known):
        raise InputError(f"source.{key}: source={option} has no such setting{suggestion(key, known)}")
    try:
        checked: Source = TypeAdapter(source).validate_python(given)
    except ValidationError as error:
        missing = [str(one["loc"][0]) for one in error.errors() if one["type"] == "missing" and len(one["loc"]) == 1]
        if missing:
            text = (CONFIG / "source" / f"{option}.yaml").read_text(encoding="utf-8")
            said = dict(re.findall(r"^ *(\w+): \?\?\? *# *(.*)$", text, re.MULTILINE))
            needs = [f"source.{key}=..." + (f" ({said[key]})" if key in said else "") for key in missing]
            raise InputError(f"source={option} needs {'; '.join(needs)}") from None
        first, keys = error.errors()[0], ["source"]
        place: Any = given
        for part in first["loc"]:  # behind the keys stand alternatives of a type
            if not isinstance(place, Mapping) or part not in place:
                break
            place, keys = place[part], [*keys, str(part)]
        expected = "more values" if first["type"] == "missing" else str(first["msg"]).removeprefix("Input should be ")
        raise InputError(f"{'.'.join(keys)}={place}: expected {expected}") from None
    return checked.recordings(seed)
