"""Recordings of one joint with a hidden effect, for tests that need a workbench."""

from pathlib import Path

import numpy as np
import polars

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tests.identification.rigs_of_any_size import Size, simulated

HIDDEN = {"excess": 0.3, "velocity": 0.5}
STRIBECK = "stribeck_friction@a"


def stribeck_recording(folder: Path) -> Recording:
    """Four trials of 3 s, two of each of two kinds."""
    return simulated(folder, Size(), find_effect("stribeck_friction"), HIDDEN)


def partly_known(folder: Path) -> Recording:
    """The same on a shaking table, which no effect of the catalogue describes."""
    for trial in stribeck_recording(folder).trials:
        table = polars.read_parquet(folder / trial.file)
        shaken = trial.position[:, 0] + 8e-3 * np.sin(44.0 * trial.time + 9.0 * trial.position[0, 0])
        table.with_columns(polars.Series("a.position", shaken)).write_parquet(folder / trial.file)
    return read_recording(folder)
