"""What is proposed is played here in every model, in shorter steps, and on the axis that made the recording."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.in_words import next_steps
from tactile_cube.identification.next_experiment import next_experiment
from tactile_cube.identification.safe_commands import (
    Envelope,
    Limits,
    PossibleMotions,
    Safety,
    excitations,
    interval_ends,
    limits_of,
    share_used,
    trials_from_rest,
    within_limits,
)
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import no_offsets
from tactile_cube.measurement.replay.simulator import Simulator
from tests.identification import force_driven_axis
from tests.identification.fitted_rivals import fitted_rivals
from tests.identification.force_driven_axis import played
from tests.measurement.small_rig import URDF, write

STATED = 'lower="-0.5" upper="0.5" effort="1" velocity="10"'


@pytest.mark.parametrize(
    ("limit", "torque", "sources"),
    [
        (STATED, 0.8, ("URDF", "URDF", "controller")),
        (STATED, 3.0, ("URDF", "URDF", "URDF")),
        ('lower="-0.5" upper="0.5" effort="0" velocity="0"', float("inf"), ("URDF", "trials", "trials")),
        ('lower="0" upper="0" effort="1" velocity="0"', float("inf"), ("trials", "trials", "URDF")),
        ('lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"', 1.0, ("trials", "trials", "controller")),
    ],
)
def test_limits_are_those_that_are_stated_else_what_the_trials_reached(tmp_path, limit, torque, sources) -> None:
    recording = read_recording(
        write(tmp_path, lambda data: data["controller"].update(torque_limit=torque), urdf=URDF.replace(STATED, limit))
    )
    limits = limits_of(recording)
    assert tuple(limits.sources[key][0] for key in ("position", "speed", "torque")) == sources
    reached = np.concatenate([trial.position for trial in recording.trials])[:, 0]
    low, high = (-0.5, 0.5) if sources[0] == "URDF" else (reached.min(), reached.max())
    assert (limits.largest.low[0], limits.largest.high[0]) == (low, high)
    fastest = 0.3 * 2 * np.pi * 0.8
    assert limits.largest.speed[0] == (10.0 if sources[1] == "URDF" else pytest.approx(fastest, rel=0.05))
    asked = max(np.abs(3.0 * (trial.command - trial.position)[:, 0]).max() for trial in recording.trials)
    assert limits.largest.torque[0] == pytest.approx({"controller": torque, "URDF": 1.0, "trials": asked}[sources[2]])


def envelope(low: float, high: float, speed: float, torque: float) -> Envelope:
    return Envelope(*(np.array([value]) for value in (low, high, speed, torque)))


def limits(by: str) -> Limits:
    return Limits(envelope(-1.0, 3.0, 5.0, 2.0), {key: (by,) for key in ("position", "speed", "torque")})


@pytest.mark.parametrize(
    ("reached", "used"),
    [
        (envelope(-0.8, 2.8, 4.5, 1.8), 1.0),
        (envelope(-0.81, 1.0, 0.0, 0.0), 1.81 / 1.8),
        (envelope(1.0, 2.81, 0.0, 0.0), 1.81 / 1.8),
        (envelope(1.0, 1.0, 4.6, 0.0), 4.6 / 4.5),
        (envelope(1.0, 1.0, 0.0, 1.9), 1.9 / 1.8),
        (envelope(1.0, 1.0, np.nan, 0.0), np.inf),
        (envelope(-np.inf, 1.0, 0.0, 0.0), np.inf),
    ],
)
def test_a_margin_is_kept_of_each_stated_limit_and_no_motion_that_ran_away_is_within(reached, used) -> None:
    assert share_used(reached, limits("URDF").allowed(0.1)) == pytest.approx(used)
    assert within_limits(reached, limits("URDF"), 0.1) == (used <= 1.0)


def test_where_nobody_states_a_limit_a_command_may_do_what_the_trials_did() -> None:
    whole = envelope(-1.0, 3.0, 5.0, 2.0)
    assert within_limits(whole, limits("trials"), 0.1)
    assert not within_limits(whole, limits("URDF"), 0.1)


MARGIN = 0.1
VISCOUS, DRAG = {"viscous_friction": {"damping": 5.0}}, {"nonlinear_drag": {"coefficient": 10.0}}
ALLOWED = {  # low, high, speed, torque of each joint, 10 % inside what the URDF states
    "axis": [(-0.0325, 0.2825, 1.35, 36.0)],
    "two_joints": [(-0.225, 0.225, 1.8, 0.27), (-0.495, 1.395, 9.0, 0.9)],
}
EMPS = Path(__file__).parents[3] / "shared" / "data" / "emps"


@dataclass(frozen=True)
class Rivals:
    recording: Recording
    shooting: Shooting
    fits: dict[str, Fit]
    noise: NDArray[np.float64]

    @cached_property
    def motions(self) -> PossibleMotions:
        return PossibleMotions(self.shooting, self.recording, list(self.fits.values()), MARGIN)

    @cached_property
    def proposed(self) -> list[tuple[Trial, Safety]]:
        return self.motions.safe_trials(0)


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Rivals:
    recording = force_driven_axis.recorded(tmp_path_factory.mktemp("axis"))
    return Rivals(recording, *fitted_rivals(recording, VISCOUS, DRAG))


@pytest.fixture(scope="module")
def two_joints(tmp_path_factory: pytest.TempPathFactory) -> Rivals:
    narrow = URDF.replace(
        'lower="-0.5" upper="0.5" effort="1" velocity="10"', 'lower="-0.25" upper="0.25" effort="0.3" velocity="2"'
    )
    recording = read_recording(write(tmp_path_factory.mktemp("two"), urdf=narrow))
    return Rivals(recording, *fitted_rivals(recording, VISCOUS, DRAG))


def unbounded(rivals: Rivals) -> list[str]:
    """Kinds that leave the limits in some model as they were designed."""
    designed = excitations(rivals.recording, 0, rivals.shooting.time)
    return [kind for kind, commands in designed.items() if not rivals.motions.safety(kind, commands).safe]


@pytest.mark.parametrize("name", ALLOWED)
def test_a_safe_command_of_any_kind_stays_within_the_limits_in_every_model(name, request) -> None:
    rivals: Rivals = request.getfixturevalue(name)
    assert unbounded(rivals), "there is something to scale down"
    low, high, speed, torque = np.array(ALLOWED[name]).T
    zero = no_offsets(rivals.recording)
    models = [model for fit in rivals.fits.values() for model in (fit.model, *interval_ends(fit))]
    models = [replace(model, offsets={**zero, **model.offsets}) for model in models]
    finer = Simulator(rivals.recording, step=0.5 * rivals.recording.step)
    assert any(safety.safe for _, safety in rivals.proposed)
    for trial, safety in rivals.proposed:
        again = rivals.motions.safety(trial.kind, trial.command)
        assert share_used(again.reached, again.allowed) == share_used(safety.reached, safety.allowed)
        trials = trials_from_rest(rivals.recording, trial.kind, trial.command)
        for run in [run for runs in finer.free_runs(models, trials) for run in runs] if safety.safe else []:
            assert (run.position > low - 1e-3).all(), trial.kind
            assert (run.position < high + 1e-3).all(), trial.kind
            assert (np.abs(np.diff(run.position, axis=0)) < 1.02 * speed * trial.step).all(), trial.kind
            assert (np.abs(run.torque) < 1.02 * torque).all(), trial.kind


def test_forces_that_would_drive_an_axis_metres_out_of_its_range_are_scaled_until_they_do_not(axis: Rivals) -> None:
    """Open loop a force moves an axis without end; the axis itself, not a model of it, is played here."""
    assert len(unbounded(axis)) >= 4
    designed, furthest = excitations(axis.recording, 0, axis.shooting.time), 0.0
    for trial, safety in axis.proposed:
        free, _ = played(lambda row, *_, force=designed[trial.kind]: float(force[row, 0]), len(trial.time))
        tamed, _ = played(lambda row, *_, force=trial.command: float(force[row, 0]), len(trial.time))
        furthest = max(furthest, np.abs(free).max())
        assert safety.safe
        assert tamed.min() > -0.05
        assert tamed.max() < 0.3
    assert furthest > 1.0


def test_the_terminal_states_limits_margin_and_largest_values_and_when_to_stop(axis: Rivals) -> None:
    experiment = next_experiment(axis.shooting, axis.recording, axis.fits, axis.noise)
    assert experiment.decides
    assert experiment.safety.models == 2 + sum(len(interval_ends(fit)) for fit in axis.fits.values())
    text = "\n".join(next_steps(experiment, axis.recording.units))
    reached = experiment.safety.reached
    for value in (reached.low, reached.high, reached.speed, reached.torque):
        assert f"{value[0]:.3g}" in text
    assert "stop beyond -0.0325 to 0.282 m (URDF), 1.35 m/s (URDF), 36 N (URDF)" in text
    assert "10 % inside stated limits" in text
    assert "Begin at rest at a 0.02 m." in text
    assert "open loop for 12 s, and unstable by nature" in text


def test_where_no_command_is_safe_none_is_proposed_and_what_would_help_is_said(axis: Rivals, tmp_path: Path) -> None:
    """The axis begins at 0.02 m, the very end of such a range."""
    tight = force_driven_axis.recorded(tmp_path, '<limit lower="0.02" upper="0.3"/>')
    experiment = next_experiment(axis.shooting, tight, axis.fits, axis.noise)
    assert not experiment.safety.safe
    assert not experiment.decides
    text = "\n".join(next_steps(experiment, tight.units))
    assert text.startswith("No safe command was found")
    assert "To decide" not in text
    assert "control the position instead of playing torques open loop" in text
    assert "state limits of speed and torque" in text


def test_numbers_at_the_ends_of_their_intervals_take_the_others_along(axis: Rivals) -> None:
    """The more dry friction, the less viscous: one end of the one is the other end of the other."""
    fit = axis.fits["viscous_friction"]
    found = [(m.constants["static_friction"][0], m.terms[0].values["damping"]) for m in interval_ends(fit)]
    dry, damping = fit.model.constants["static_friction"][0], fit.model.terms[0].values["damping"]
    (less, more), (_, _), (weak, strong) = (found[k : k + 2] for k in (0, 2, 4))
    assert less[0] < dry < more[0]
    assert weak[1] < damping < strong[1]
    assert less[1] > damping > more[1]


@pytest.mark.skipif(not EMPS.exists(), reason="the shared recordings are not here")
def test_a_real_axis_of_95_kg_is_not_driven_out_of_its_range(tmp_path: Path) -> None:
    """The EMPS benchmark's axis moves by 0.25 m; two laws of friction, each with a constant force."""
    thin = slice(None, None, 10)
    logs = {kind: np.load(EMPS / f"emps_{kind}.npz") for kind in ("sweep", "pulses")}
    arrays = {kind: (log["force_N"][thin].astype(float), log["position_m"][thin]) for kind, log in logs.items()}
    limit = '<limit lower="-0.05" upper="0.3" effort="400" velocity="0.5"/>'
    recording = force_driven_axis.written(tmp_path, arrays, limit, step=0.01, mass=95.11, dry=20.39)
    bias = {"torque_bias": {"bias": 3.0}}
    laws = {"viscous_friction": {"damping": 200.0}}, {"nonlinear_drag": {"coefficient": 1000.0}}
    emps = Rivals(recording, *fitted_rivals(recording, *(law | bias for law in laws)))
    free = [emps.motions.safety(*one).reached for one in excitations(recording, 0, emps.shooting.time).items()]
    assert max(one.high[0] for one in free) > 1.3, "as it was designed"
    experiment = next_experiment(emps.shooting, recording, emps.fits, emps.noise)
    assert experiment.decides
    reached = experiment.safety.reached
    assert -0.0325 < reached.low[0] < reached.high[0] < 0.2825
    assert reached.speed[0] < 0.45


def test_a_number_of_which_the_data_say_nothing_stays_where_it_is(axis: Rivals) -> None:
    fit = axis.fits["viscous_friction"]
    silent = next(k for k, unknown in enumerate(fit.unknowns) if unknown.kind == "effect")
    information = fit.information.copy()
    information[silent], information[:, silent] = 0.0, 0.0
    value = fit.model.terms[0].values["damping"]
    ends = interval_ends(replace(fit, information=information))
    assert all(model.terms[0].values["damping"] == value for model in ends)
    assert all(np.isfinite(model.constants["static_friction"]).all() for model in ends)
