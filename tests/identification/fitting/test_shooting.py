"""Multiple shooting against the free-running replay, where a gap of the transmission hides the links."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.drivetrain.effects.command import CommandDelay
from tactile_cube.drivetrain.effects.transmission import Backlash
from tactile_cube.identification.fitting.problem import Problem, Shooting, with_initial_states
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term, nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.replay.windows import Windows, cut
from tests.measurement.small_rig import write

GAP = 0.03
NOISE = np.full(2, 1e-4)
EFFECTS = tuple(catalogue().values())  # as the replay: one kernel is compiled for both


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """Commands of two joints at 100 Hz, far apart: every row's jump moves a free motor at once."""
    whole = read_recording(write(tmp_path))
    return whole.with_trials(whole.trials[:1])


def with_gap(recording: Recording) -> Model:
    plain = nominal_model(recording)
    return replace(plain, terms=(Term(Backlash, "b", {"play": 0.0, "gap": GAP}, ("gap",)),))


def measured(recording: Recording, model: Model) -> Recording:
    """The recording as a fine free-running simulation would have logged it."""
    (result,) = free_run(recording, model, step=5e-4)
    return recording.with_trials((replace(recording.trials[0], position=result.position),))


@pytest.mark.parametrize("gap", [True, False])
def test_segments_show_what_the_replay_logs(recording: Recording, gap: bool) -> None:
    model = with_gap(recording) if gap else nominal_model(recording)
    logged = measured(recording, model)
    windows = cut(logged, NOISE)
    error = (Shooting(logged, EFFECTS).positions([model], windows)[0] - windows.measured)[windows.weight > 0.0]
    assert np.sqrt(np.mean(error**2)) < 5e-4, "a motor that floats jumps with the whole command"


@pytest.mark.parametrize("delay", [0.010, 0.0135, 0.017])
def test_a_delayed_jump_is_felt_when_it_acts_and_not_at_the_row(recording: Recording, delay: float) -> None:
    plain = nominal_model(recording)
    model = replace(plain, terms=tuple(Term(CommandDelay, joint, {"delay": delay}, ("delay",)) for joint in "ab"))
    logged = measured(recording, model)
    windows = cut(logged, NOISE)
    error = Shooting(logged, EFFECTS).positions([model], windows)[0] - windows.measured
    later = windows.weight > 0.0
    later[:, : windows.segment] = False  # the trial begins with a speed that its first rows hardly show
    assert np.sqrt(np.mean(error[later] ** 2)) < 2e-4, (
        "a delay that is no whole number of rows leaves no more than one that is"
    )


def hidden_start(recording: Recording, place: float) -> tuple[Shooting, Model, Windows]:
    """Windows whose measurement began with the link of b at `place` [rad] from the middle of its gap, at rest."""
    model, windows = with_gap(recording), cut(recording, NOISE)
    shooting = Shooting(recording, EFFECTS)
    initial_state = np.zeros_like(windows.initial_state)
    initial_state[:, 1], initial_state[:, 3] = place, -windows.speed[:, 0, 1]
    seen = shooting.positions_from(model, [initial_state], windows)[0]
    return shooting, model, replace(windows, measured=seen)


@pytest.mark.parametrize("place", [-0.4 * GAP, 0.3 * GAP])
def test_the_place_of_a_hidden_link_at_the_start_is_found(recording: Recording, place: float) -> None:
    shooting, model, windows = hidden_start(recording, place)
    found = with_initial_states(shooting, model, windows)

    def error(of: Windows) -> float:
        residual = (shooting.positions([model], of)[0] - of.measured)[:, : of.segment]
        return float(np.sqrt(np.mean(residual**2)))

    assert error(found) < 0.2 * error(windows)
    assert np.all(found.initial_state[:, [0, 2]] == 0.0), "the joint without a gap is where its sensor says"
    assert found.initial_state[0, 1] == pytest.approx(place, abs=0.1 * GAP)


def test_without_a_gap_every_trial_begins_where_its_sensors_say(recording: Recording) -> None:
    windows = cut(recording, NOISE)
    shooting, plain = Shooting(recording, EFFECTS), nominal_model(recording)
    assert with_initial_states(shooting, plain, windows) is windows
    elsewhere = replace(windows, initial_state=np.full_like(windows.initial_state, 0.1))  # by a model with a gap
    assert np.all(with_initial_states(shooting, plain, elsewhere).initial_state == 0.0)


@pytest.mark.parametrize("models", [1, 2, 3])
def test_any_number_of_cores_gives_the_same_bits(recording: Recording, models: int) -> None:
    windows = cut(recording, NOISE, segment=10)
    assert len(windows) > 1
    shooting = Shooting(recording, EFFECTS)
    wanted = [with_gap(recording), nominal_model(recording), with_gap(recording)][:models]
    shooting.workers = 1
    alone = shooting.positions(wanted, windows)
    shooting.workers = 2
    np.testing.assert_array_equal(shooting.positions(wanted, windows), alone)


def test_a_simulation_that_runs_away_swamps_no_other(recording: Recording) -> None:
    class Away(Shooting):
        """Its first simulation ends nowhere, its second one far off."""

        def simulate(self, *given: Any, **more: Any) -> Any:
            out = super().simulate(*given, **more)
            out[0], out[1] = np.nan, 1e200
            return out

    windows, model = cut(recording, NOISE), nominal_model(recording)
    problem = Problem(Away(recording, EFFECTS), windows)
    problem.linearise_starts(model)
    sane = Shooting(recording, EFFECTS)
    residual = problem.residual(windows.by_segment(sane.positions([model], windows)[0])[None])[0]
    assert np.isfinite(problem.cost(residual)).all()
    slopes = Away(recording, EFFECTS).start_sensitivity(model, windows)
    assert not slopes[0].any()
    np.testing.assert_array_equal(slopes[2:], sane.start_sensitivity(model, windows)[2:])
