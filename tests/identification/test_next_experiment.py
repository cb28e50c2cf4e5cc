from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import polars as pl

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.diagnosis import UNPROVEN, Diagnosis, open_fits
from tactile_cube.identification.fitting.intervals import Fitted
from tactile_cube.identification.fitting.shooting import Shooting
from tactile_cube.identification.next_experiment import FASTEST, Experiment, next_experiment, safe_excitations
from tactile_cube.identification.search.division import Division
from tactile_cube.identification.verdict import Kind, Verdict
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.noise import sensor_noise
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.model import Term
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import Size, simulated
from tests.identification.test_verdict import FIT, explanation, findings
from tests.measurement.small_rig import write

RIVALS = [find_effect(name) for name in ("payload", "torque_gain", "viscous_friction", "nonlinear_drag")]


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
    experiment = Experiment("slow triangles", ("a", "b"), time, np.ones((3, 2)), 2.0, "a", {})
    table = pl.read_csv(experiment.write(tmp_path))
    assert table.columns == ["time", "a.command", "b.command"]
    assert table["b.command"].to_list() == [1.0, 1.0, 1.0]


def undecided(kind: Kind, rivals: int, doubtful: int) -> Diagnosis:
    """A diagnosis of that verdict, with so many rivals and unproven effects."""
    names = ["backlash", "torque_bias", "torque_gain", "payload", "cogging"]
    told = findings(20.0)
    unproven = tuple(explanation(name, 5.0) for name in names[:doubtful])
    fitted = Fitted(FIT.model, FIT, np.zeros(0), np.zeros(0))
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
    rivals = [name.partition("(")[0] for name in open_fits(undecided("ambiguous", 2, 0))]
    assert rivals == ["command_delay", "backlash", "torque_bias"]
    doubtful = open_fits(undecided("unknown_effect", 0, 5))
    assert next(iter(doubtful)) == "none of them"
    assert len(doubtful) == 1 + UNPROVEN
    assert len(open_fits(undecided("adequate", 0, 2))) == 1, "nothing to decide where nothing is missing"


def told_apart(folder: Path, hidden: str, values: dict[str, float], *rivals: dict[str, dict[str, float]]) -> Experiment:
    """The next experiment of a pendulum with an effect that sets of effects with these starts may explain."""
    recording = simulated(folder, Size(), find_effect(hidden), values)
    fitted, held_out = held_out_split(recording)
    noise = sensor_noise(recording)
    division = Division(Shooting(fitted, RIVALS), fitted, held_out, noise)
    fits = {}
    for rival in rivals:
        named = [(find_effect(name)("a", **start), tuple(start)) for name, start in rival.items()]
        terms = tuple(Term(type(effect), "a", effect.values, free) for effect, free in named)
        fits["+".join(rival)] = division.refitted(replace(division.start, terms=terms))
    return next_experiment(division.shooting, recording, fits, noise)


def test_what_no_command_tells_apart_is_said_to_be_so(tmp_path: Path) -> None:
    """A pendulum that weighs less turns as one whose torque is larger."""
    lighter, stronger = {"payload": {"mass": -0.02, "distance": 0.1}}, {"torque_gain": {"error": 0.1}}
    experiment = told_apart(tmp_path, "payload", lighter["payload"], lighter, stronger)
    assert experiment.inseparable == (("payload", "torque_gain"),)
    assert not experiment.decides


def test_laws_that_differ_at_speed_are_told_apart_by_a_fast_command(tmp_path: Path) -> None:
    viscous, drag = {"viscous_friction": {"damping": 0.02}}, {"nonlinear_drag": {"coefficient": 0.002}}
    experiment = told_apart(tmp_path, "viscous_friction", {"damping": 0.02}, viscous, drag)
    assert experiment.inseparable == ()
    assert experiment.decides
