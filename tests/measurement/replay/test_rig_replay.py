from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.error import residuals, summarise
from tactile_cube.measurement.recordings.description import KnownForce
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.known_force import force_torque
from tactile_cube.measurement.replay.parameters import draw_parameters, nominal_parameters, require_same_joints
from tactile_cube.measurement.replay.rig_replay import Replay, replay
from tests.measurement.small_rig import write

SHARED = Path(__file__).parents[4] / "shared" / "recordings"
TRUE = {
    "kd": np.array([0.23595, 0.22932, 0.22615]),
    "static_friction": np.array([0.02432, 0.02429, 0.01524]),
    "reflected_inertia": np.array([0.00281, 0.00315, 0.00318]),
}


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return read_recording(write(tmp_path))


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs ../shared/recordings")
def test_the_true_constants_follow_an_independent_engine_to_its_noise() -> None:
    recording = read_recording(SHARED / "finger_plain" / "validation")
    parameters = nominal_parameters(recording, None)
    parameters.constants.update(TRUE)
    simulated = replay(recording, parameters, "fast", 2.5e-4)
    error = summarise(residuals(recording.trials, [one.position for one in simulated]), recording.joints)
    assert error.overall < 4.5e-4


def test_fast_and_pybullet_agree(recording: Recording) -> None:
    recording = recording.with_trials(recording.trials[:1])
    parameters = nominal_parameters(recording, None)
    fast, bullet = (replay(recording, parameters, engine, 0.002)[0] for engine in ("fast", "pybullet"))
    assert np.abs(fast.position - bullet.position).max() < 1e-9
    assert np.abs(fast.torque - bullet.torque).max() < 1e-8


def test_an_unknown_engine_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="engine=mujoco"):
        Replay(recording, engine="mujoco")  # type: ignore[arg-type]


def test_a_clamped_link_shows_the_drive_stiffness(recording: Recording) -> None:
    trial = replace(recording.trials[0], clamped=True)
    result = Replay(recording).simulate([trial], nominal_parameters(recording, None))[0]
    slope = np.polyfit(result.torque[:, 0], result.position[:, 0], 1)[0]
    assert slope == pytest.approx(1 / 25.0, rel=1e-3)


def test_a_known_force_moves_a_static_finger_by_force_over_stiffness(recording: Recording) -> None:
    trial = recording.trials[0]
    still = replace(trial, command=np.zeros_like(trial.command), position=np.zeros_like(trial.position), torque=None)
    pushed = replace(still, force=KnownForce(joint="b", point=[0.0, 0.0, -0.05], vector=[2.0, 0.0, 0.0]))
    parameters = nominal_parameters(recording, None)
    parameters.constants["static_friction"] = np.zeros(2)
    simulator = Replay(recording)
    free, forced = simulator.simulate([still, pushed], parameters)
    torque = force_torque(simulator.tree, pushed.force, np.zeros(2))
    assert torque == pytest.approx([-0.15 * 2.0, 0.0])
    gravity = 9.81 * (0.1 * 0.05 + 0.05 * 0.13)  # stiffness of the hanging links [N m/rad]
    expected = torque[0] / (3.0 + gravity * (1 + 3.0 / 25.0))
    assert forced.position[-1, 0] - free.position[-1, 0] == pytest.approx(expected, rel=0.03)


def test_a_force_on_an_unknown_joint_is_refused(recording: Recording) -> None:
    tree = Replay(recording).tree
    with pytest.raises(InputError, match="'thumb' is not a joint"):
        force_torque(tree, KnownForce(joint="thumb", point=[0, 0, 0], vector=[0, 0, 0]), np.zeros(2))


def test_a_model_file_changes_the_simulation(recording: Recording) -> None:
    slow = Estimate(value=0.02, low=0.01, high=0.03, unit="s")
    model = ModelFile(
        joints=["a", "b"],
        values={"kd": {"a": Estimate(value=0.5, low=0.5, high=0.5)}},
        effects=[EffectEstimate(effect="command_delay@b", parameters={"delay": slow})],
    )
    parameters = nominal_parameters(recording, model)
    assert parameters.constants["kd"].tolist() == [0.5, 0.2]
    with_model = replay(recording, parameters, "fast", 0.002)[0]
    without = replay(recording, nominal_parameters(recording, None), "fast", 0.002)[0]
    assert np.abs(with_model.position - without.position).max(axis=0).min() > 1e-3


def test_a_model_of_another_rig_is_refused(recording: Recording) -> None:
    with pytest.raises(InputError, match="are not those of the recording"):
        require_same_joints(recording, ModelFile(joints=["q1"]))


def test_draws_come_from_the_interval_or_the_spread(recording: Recording) -> None:
    model = ModelFile(joints=["a", "b"], values={"kd": {"a": Estimate(value=0.3, low=0.29, high=0.31)}})
    rng = np.random.default_rng(0)
    draws = [draw_parameters(recording, model, {"kd": 0.5, "offset": 0.02}, rng) for _ in range(200)]
    kd = np.array([draw.constants["kd"] for draw in draws])
    assert 0.29 <= kd[:, 0].min() < 0.292 < 0.308 < kd[:, 0].max() <= 0.31
    assert 0.1 <= kd[:, 1].min() < 0.12 < 0.28 < kd[:, 1].max() <= 0.3
    assert np.abs([draw.offset for draw in draws]).max() <= 0.02


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
    result = Replay(recording).simulate([trial], nominal_parameters(recording, None))[0]
    inertia = 0.01 + Replay(recording).tree.actuated_mass_matrix(np.zeros(2))[0, 0]
    expected = 0.5 * 0.002 / inertia * (trial.time[49] + trial.step) ** 2
    assert result.position[49, 0] == pytest.approx(expected, rel=0.02)
    assert result.torque[49, 0] == pytest.approx(0.002, rel=1e-4)
