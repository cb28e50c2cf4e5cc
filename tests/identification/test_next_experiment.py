import json
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import polars as pl

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.diagnosis import UNPROVEN, Diagnosis, open_fits
from tactile_cube.identification.diagnosis_json import safety_as_json
from tactile_cube.identification.fitting.resolution import Fitted
from tactile_cube.identification.next_experiment import Experiment, next_experiment
from tactile_cube.identification.safe_commands import FASTEST, excitations
from tactile_cube.identification.standard_model import StandardModel
from tactile_cube.identification.verdict import Kind, Verdict
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.reading import read_recording
from tests.identification.easy_safety import half_used
from tests.identification.fitted_rivals import Rival, fitted_rivals
from tests.identification.rigs_of_any_size import Size, simulated
from tests.identification.test_verdict import FIT, explanation, findings
from tests.measurement.small_rig import write


def test_commands_stay_within_positions_and_speeds_that_were_safe(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    shown = np.concatenate([trial.command for trial in recording.trials])
    fastest = np.max([np.abs(np.diff(trial.command, axis=0)).max(axis=0) for trial in recording.trials], axis=0)
    for name, commands in excitations(recording, 0).items():
        assert (commands >= shown.min(axis=0) - 1e-9).all(), name
        assert (commands <= shown.max(axis=0) + 1e-9).all(), name
        assert (np.abs(np.diff(commands, axis=0)) <= FASTEST * fastest + 1e-9).all(), name


def test_the_command_file_has_the_columns_of_a_recording(tmp_path: Path) -> None:
    time = np.arange(3) * 0.01
    experiment = Experiment("slow triangles", ("a", "b"), time, np.ones((3, 2)), 2.0, "a", {}, half_used(2))
    table = pl.read_csv(experiment.write(tmp_path))
    assert table.columns == ["time", "a.command", "b.command"]
    assert table["b.command"].to_list() == [1.0, 1.0, 1.0]


def test_the_safety_of_a_command_is_plain_json_even_where_a_simulation_ran_away() -> None:
    safety = half_used(1)
    safety = replace(safety, reached=replace(safety.reached, high=np.array([np.inf])))
    experiment = Experiment("slow triangles", ("a",), np.arange(3.0), np.ones((3, 1)), 9.0, "a", {}, safety)
    assert not experiment.decides
    data = json.loads(json.dumps(safety_as_json(experiment), allow_nan=False))
    assert data["safe"] is False
    assert data["joints"]["a"]["reached"] == {"low": -0.45, "high": None, "speed": 4.5, "torque": 0.9}
    assert data["joints"]["a"]["stop_beyond"] == {"low": -0.9, "high": 0.9, "speed": 9.0, "torque": 1.8}
    assert data["joints"]["a"]["stated_by"]["torque"] == "URDF"


def undecided(kind: Kind, rivals: int, doubtful: int) -> Diagnosis:
    """A diagnosis of that verdict, with so many rivals and unproven effects."""
    names = ["backlash", "torque_bias", "torque_gain", "payload", "cogging"]
    told = findings(20.0)
    unproven = tuple(replace(explanation(name, 5.0), p_value=0.5) for name in names[:doubtful])
    fitted = Fitted(FIT.model, FIT, np.zeros(0), np.zeros(0))
    others = tuple((explanation(name, 1.0), fitted) for name in names[:rivals])
    chosen = explanation("command_delay", 1.0) if rivals else told.base
    return Diagnosis(
        Verdict(kind, chosen),
        replace(told, judged=unproven),
        fitted,
        others,
        {},
        {},
        cast("NoiseFloor", None),
        [],
        None,
        cast("StandardModel", None),
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


def told_apart(folder: Path, hidden: str, values: dict[str, float], *rivals: Rival) -> Experiment:
    """The next experiment of a pendulum with an effect that sets of effects with these starts may explain."""
    recording = simulated(folder, Size(), find_effect(hidden), values)
    shooting, fits, noise = fitted_rivals(recording, *rivals)
    return next_experiment(shooting, recording, fits, noise)


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
