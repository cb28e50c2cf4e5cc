from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import polars as pl

from tactile_cube.identification.diagnosis import UNPROVEN, Diagnosis, open_models
from tactile_cube.identification.fitting.intervals import Fitted
from tactile_cube.identification.next_experiment import FASTEST, Experiment, safe_excitations
from tactile_cube.identification.verdict import Kind, Verdict
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.reading import read_recording
from tests.identification.test_verdict import FIT, explanation, findings
from tests.measurement.small_rig import write


def test_commands_stay_within_positions_and_speeds_that_were_safe(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    shown = np.concatenate([trial.command for trial in recording.trials])
    fastest = max(np.abs(np.diff(trial.command, axis=0)).max() for trial in recording.trials)
    for name, commands in safe_excitations(recording, 0).items():
        assert (commands >= shown.min(axis=0) - 1e-9).all(), name
        assert (commands <= shown.max(axis=0) + 1e-9).all(), name
        assert np.abs(np.diff(commands, axis=0)).max() <= FASTEST * fastest + 1e-9, name


def test_the_command_file_has_the_columns_of_a_recording(tmp_path: Path) -> None:
    time = np.arange(3) * 0.01
    experiment = Experiment("slow triangles", ("a", "b"), time, np.ones((3, 2)), 1e-3, "a", {})
    table = pl.read_csv(experiment.write(tmp_path))
    assert table.columns == ["time", "a.command", "b.command"]
    assert table["b.command"].to_list() == [1.0, 1.0, 1.0]


def undecided(kind: Kind, rivals: int, doubtful: int) -> Diagnosis:
    """A diagnosis of that verdict, with so many rivals and unproven effects."""
    names = ["backlash", "torque_bias", "torque_gain", "payload", "cogging"]
    told = findings(20.0)
    unproven = tuple(explanation(name, 5.0) for name in names[:doubtful])
    fitted = cast("Fitted", FIT)
    others = tuple((explanation(name, 1.0), fitted) for name in names[:rivals])
    chosen = explanation("command_delay", 1.0) if rivals else told.base
    return Diagnosis(
        Verdict(kind, chosen),
        replace(told, unproven=unproven),
        fitted,
        others,
        {},
        {},
        cast("NoiseFloor", None),
        [],
        None,
        [],
        [],
    )


def test_what_is_told_apart_are_rivals_or_else_what_is_unproven_and_nothing() -> None:
    rivals = [name.partition("(")[0] for name in open_models(undecided("ambiguous", 2, 0))]
    assert rivals == ["command_delay", "backlash", "torque_bias"]
    doubtful = open_models(undecided("unknown_effect", 0, 5))
    assert next(iter(doubtful)) == "none of them"
    assert len(doubtful) == 1 + UNPROVEN
    assert len(open_models(undecided("adequate", 0, 2))) == 1, "nothing to decide where nothing is missing"
