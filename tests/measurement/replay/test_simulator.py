"""Positions that are older or younger than the row that logs them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects.command import CommandDelay, RateLimit
from tactile_cube.drivetrain.effects.transmission import Backlash
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.recordings.description import KnownForce
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term, draw_model, nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulator, force_torque, free_run
from tactile_cube.measurement.replay.windows import cut
from tests.measurement.small_rig import write

SHARED = Path(__file__).parents[4] / "shared" / "recordings"
TRUE = {
    "kd": np.array([0.23595, 0.22932, 0.22615]),
    "static_friction": np.array([0.02432, 0.02429, 0.01524]),
    "reflected_inertia": np.array([0.00281, 0.00315, 0.00318]),
}


def with_constants(model: Model, **constants: np.ndarray) -> Model:
    return replace(model, constants={**model.constants, **constants})


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return read_recording(write(tmp_path))


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs ../shared/recordings")
def test_the_true_constants_follow_an_independent_engine_to_its_noise() -> None:
    recording = read_recording(SHARED / "finger_plain" / "validation")
    simulated = free_run(recording, with_constants(nominal_model(recording), **TRUE), step=2.5e-4)
    assert free_run_error(recording, simulated).overall < 4.5e-4


def test_a_clamped_link_shows_the_drive_stiffness(recording: Recording) -> None:
    trial = replace(recording.trials[0], clamped=True)
    ((result,),) = Simulator(recording).free_runs([nominal_model(recording)], [trial])
    slope = np.polyfit(result.torque[:, 0], result.position[:, 0], 1)[0]
    assert slope == pytest.approx(1 / 25.0, rel=1e-3)


def test_a_free_run_starts_where_the_first_row_is_within_a_smooth_play(recording: Recording) -> None:
    """3 N m/rad hold half of the softness' torque, at which the motor leads by 7 of 30 mrad."""
    still = np.full_like(recording.trials[0].position, 0.1)
    trial = replace(recording.trials[0], clamped=True, position=still, command=still + 0.5 * 0.004 / 3.0)
    play = Term(Backlash, "a", {"play": 0.0, "gap": 0.0, "smooth": 0.03, "softness": 0.004, "crossing": 0.0}, ())
    ((result,),) = Simulator(recording).free_runs([replace(nominal_model(recording), terms=(play,))], [trial])
    assert result.position[:, 0] == pytest.approx(0.1, abs=1e-6)


def delayed(seconds: float) -> Term:
    return Term(CommandDelay, "a", {"delay": seconds}, ())


@pytest.mark.parametrize("terms", [(), (delayed(0.1),), (delayed(0.1), Term(RateLimit, "a", {"speed": 0.2}, ()))])
def test_only_the_past_that_effects_remember_is_played_and_nothing_changes(recording, monkeypatch, terms) -> None:
    model = replace(nominal_model(recording), terms=terms)
    windows = cut(recording, np.full(2, 1e-4), segment=8)
    assert windows.history == 240
    assert np.any(windows.time > 2.0)
    simulator = Simulator(recording)
    some = simulator.simulate([model], [windows])
    monkeypatch.setattr(Simulator, "_past", lambda self, model, windows: windows.history * windows.substeps)
    assert np.array_equal(simulator.simulate([model], [windows]), some)


@pytest.mark.parametrize(("read", "felt"), [("after", 0), ("before", 1)])
def test_a_row_feels_the_command_that_was_in_force_until_it_was_read(tmp_path: Path, read: str, felt: int) -> None:
    """A clamped link: the drive's deflection is the command's alone, 3 / (3 + 25) of it, and it jumps with it."""

    def change(data: dict) -> None:
        data["sensors"]["read"] = read

    recording = read_recording(write(tmp_path, change))
    command = np.random.default_rng(0).uniform(-0.1, 0.1, recording.trials[0].command.shape)
    trial = replace(recording.trials[0], command=command, clamped=True)
    ((result,),) = Simulator(recording).free_runs([nominal_model(recording)], [trial])
    moved, commanded = np.diff(result.position[5:-5], axis=0), np.diff(command[5 - felt : -5 - felt], axis=0)
    np.testing.assert_allclose(moved, 3.0 / 28.0 * commanded, atol=1e-6)


def test_a_known_force_moves_a_static_finger_by_force_over_stiffness(recording: Recording) -> None:
    trial = recording.trials[0]
    still = replace(trial, command=np.zeros_like(trial.command), position=np.zeros_like(trial.position), torque=None)
    pushed = replace(still, force=KnownForce(joint="b", point=[0.0, 0.0, -0.05], vector=[2.0, 0.0, 0.0]))
    model = with_constants(nominal_model(recording), static_friction=np.zeros(2))
    simulator = Simulator(recording)
    ((free, forced),) = simulator.free_runs([model], [still, pushed])
    torque = force_torque(simulator.tree, pushed.force, np.zeros(2))
    assert torque == pytest.approx([-0.15 * 2.0, 0.0])
    gravity = 9.81 * (0.1 * 0.05 + 0.05 * 0.13)  # stiffness of the hanging links [N m/rad]
    expected = torque[0] / (3.0 + gravity * (1 + 3.0 / 25.0))
    assert forced.position[-1, 0] - free.position[-1, 0] == pytest.approx(expected, rel=0.03)


def test_a_force_on_an_unknown_joint_is_refused(recording: Recording) -> None:
    tree = recording.rigid_body()
    with pytest.raises(InputError, match="'thumb' is not a joint"):
        force_torque(tree, KnownForce(joint="thumb", point=[0, 0, 0], vector=[0, 0, 0]), np.zeros(2))


def test_a_model_file_changes_the_simulation(recording: Recording) -> None:
    slow = Estimate(value=0.02, low=0.01, high=0.03, unit="s")
    model = ModelFile(
        joints=["a", "b"],
        values={"kd": {"a": Estimate(value=0.5, low=0.5, high=0.5)}},
        effects=[EffectEstimate(effect="command_delay@b", parameters={"delay": slow})],
    )
    changed = nominal_model(recording, model)
    assert changed.constants["kd"].tolist() == [0.5, 0.2]
    with_model, without = (free_run(recording, one)[0] for one in (changed, nominal_model(recording)))
    assert np.abs(with_model.position - without.position).max(axis=0).min() > 1e-3


def test_a_model_of_another_rig_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="are not those of the recording"):
        require_same_joints(recording, ModelFile(joints=["q1"]))


def test_draws_come_from_the_interval_or_the_spread(recording: Recording) -> None:
    model = ModelFile(joints=["a", "b"], values={"kd": {"a": Estimate(value=0.3, low=0.29, high=0.31)}})
    rng = np.random.default_rng(0)
    draws = [draw_model(recording, model, {"kd": 0.5, "offset": 0.02}, rng) for _ in range(200)]
    kd = np.array([draw.constants["kd"] for draw in draws])
    assert 0.29 <= kd[:, 0].min() < 0.292 < 0.308 < kd[:, 0].max() <= 0.31
    assert 0.1 <= kd[:, 1].min() < 0.12 < 0.28 < kd[:, 1].max() <= 0.3
    assert np.abs([draw.offsets[0] for draw in draws]).max() <= 0.02


def test_commanded_torques_drive_the_joint(tmp_path: Path) -> None:
    def change(data: dict) -> None:
        data["controller"] = {"mode": "torque"}
        data["gravity"] = [0.0, 0.0, 0.0]
        data["nominal"] = {"reflected_inertia": 0.01}

    def spoil(columns: dict) -> None:
        for name in list(columns):
            if name != "time":
                columns[name] = np.zeros(300)
        columns["a.command"] += 0.002

    recording = read_recording(write(tmp_path, change, spoil))
    trial = recording.trials[0]
    ((result,),) = Simulator(recording).free_runs([nominal_model(recording)], [trial])
    inertia = 0.01 + recording.rigid_body().actuated_mass_matrix(np.zeros(2))[0, 0]
    expected = 0.5 * 0.002 / inertia * trial.time[49] ** 2
    assert result.position[49, 0] == pytest.approx(expected, rel=0.02)
    assert result.torque[49, 0] == pytest.approx(0.002, rel=1e-4)


def recording_controller_rate(folder: Path, rate: float | None) -> Recording:
    def change(data: dict) -> None:
        if rate is not None:
            data["controller"]["rate_hz"] = rate

    return read_recording(write(folder, change))


def simulated(folder: Path, rate: float | None, step: float) -> np.ndarray:
    one = recording_controller_rate(folder, rate)
    return np.concatenate([trial.position for trial in free_run(one, nominal_model(one), step=step)])


def test_the_law_runs_at_the_controllers_rate_whatever_the_simulations_step(tmp_path: Path) -> None:
    often = simulated(tmp_path / "often", 1000, step=0.01)
    assert np.array_equal(often, simulated(tmp_path / "small", None, step=0.001))
    assert np.abs(often - simulated(tmp_path / "log", None, step=0.01)).max() > 1e-4


def test_by_default_the_controller_is_as_fast_as_the_log(tmp_path: Path) -> None:
    assert recording_controller_rate(tmp_path / "a", None).substeps(0.01) == 1
    assert recording_controller_rate(tmp_path / "b", 100).substeps(0.01) == 1
    assert recording_controller_rate(tmp_path / "c", 1000).substeps(0.01) == 10
    assert recording_controller_rate(tmp_path / "d", 1000).substeps(0.0005) == 20


def test_a_controller_slower_than_the_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"key 'controller\.rate_hz': received 50, below"):
        recording_controller_rate(tmp_path, 50)


@pytest.mark.parametrize("rows", [-0.5, 0.3, 1.0])
def test_a_reading_shows_the_position_of_a_part_of_a_row_before(rows: float, tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    model, delay = nominal_model(recording), rows * recording.step
    late = replace(model, constants={**model.constants, "reading_delay": np.full(2, delay)})
    exact, shown = (free_run(recording, one)[0].position for one in (model, late))
    time = recording.trials[0].time
    expected = np.stack([np.interp(time - delay, time, column) for column in exact.T], axis=1)
    assert np.abs(shown - expected)[2:-2].max() < 0.1 * np.abs(exact - expected)[2:-2].max()
