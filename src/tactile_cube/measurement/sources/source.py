"""What every source of recordings gives."""

from collections.abc import Mapping
from typing import Protocol, TypeVar

from tactile_cube.measurement.recordings.description import Description, TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables

Value = TypeVar("Value")
PLACEHOLDER = [TrialEntry(file="none")]


class Source(Protocol):
    """Makes recordings."""

    def recordings(self, seed: int) -> dict[str, RecordingTables]:
        """Sub-folder -> recording; `""` is the recording itself, `validation` what identification must not see."""
        ...


def described(**values: object) -> Description:
    """A checked description whose trials are to come from the tables."""
    return Description.model_validate({"format": 1, "trials": PLACEHOLDER} | values)


def known(values: Mapping[str, Value | None]) -> dict[str, Value]:
    """The entries that are not None."""
    return {key: value for key, value in values.items() if value is not None}
