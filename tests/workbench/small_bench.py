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
    """The same on a shaking table, which no effect of the catalogue describes.

    It shakes differently each time: where a law followed a part of it, a search would go on far longer.
    """
    rng = np.random.default_rng(0)
    for trial in stribeck_recording(folder).trials:
        table = polars.read_parquet(folder / trial.file)
        shaking = sum(np.sin(speed * trial.time + rng.uniform(0.0, 2 * np.pi)) for speed in (44.0, 61.0))
        shaken = trial.position[:, 0] + 5e-3 * shaking
        table.with_columns(polars.Series("a.position", shaken)).write_parquet(folder / trial.file)
    return read_recording(folder)
