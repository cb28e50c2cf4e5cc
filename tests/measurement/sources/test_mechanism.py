"""Logs without a URDF: one joint sized by its own motion, and servos by their names."""

from pathlib import Path
from typing import Any

import numpy as np
import polars
import pytest

from tactile_cube.errors import InputError
from tactile_cube.identification.identification import divided
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recordings
from tactile_cube.measurement.sources.mechanism import read_servo, servos
from tactile_cube.measurement.sources.source import recording_tables, source_settings
from tests.measurement.sources.bare_joint import INERTIA, KD, KP, LEVER, MASS, WEIGHT, played


def imported(folder: Path, log: dict[str, np.ndarray], **settings: Any) -> Recording:
    folder.mkdir(exist_ok=True)
    polars.DataFrame(log).write_csv(folder / "run.csv")
    given = {"files": [str(folder / "run.csv")], "read": "after", **settings}
    write_recordings(folder / "out", recording_tables(source_settings("csv", given), "csv", 0))
    return read_recording(folder / "out")


def seen(recording: Recording) -> tuple[float, float]:
    """Inertia with the rotor, and weight times lever a quarter turn away from where the zero of the log is."""
    tree = recording.rigid_body()
    rotor = float(recording.nominal["reflected_inertia"][0])
    still = np.zeros((1, 1))
    weight = tree.inverse_dynamics(np.full((1, 1), np.pi / 2), still, still, recording.gravity)
    return float(tree.actuated_mass_matrix(np.zeros(1))[0, 0]) + rotor, float(weight[0, 0])


@pytest.mark.parametrize("robot", ["pendulum", "wheel", "slide"])
def test_inertia_weight_and_damping_are_seen_beside_a_stated_gain(tmp_path: Path, robot: str) -> None:
    recording = imported(tmp_path, played(robot), robot=robot, controller={"kp": KP})
    inertia, weight = seen(recording)
    assert inertia == pytest.approx(INERTIA, rel=0.1)
    assert weight == pytest.approx(WEIGHT if robot == "pendulum" else 0.0, rel=0.1, abs=1e-9)
    assert float(recording.gains.kd[0]) == pytest.approx(KD, rel=0.2)
    assert recording.gains.kp.tolist() == [KP]
    assert ("mass" in recording.description.unknown) == (robot == "pendulum")


def test_without_a_gain_all_is_in_proportion_to_one(tmp_path: Path) -> None:
    recording = imported(tmp_path, played("pendulum"), robot="pendulum")
    assert recording.gains.kp.tolist() == [1.0]
    assert seen(recording)[1] == pytest.approx(WEIGHT / KP, rel=0.1)
    assert any("only the ratios are known" in line for line in recording.description.doubts)


def test_commanded_torques_show_inertia_and_weight(tmp_path: Path) -> None:
    controller = {"mode": "torque"}
    recording = imported(
        tmp_path, played("pendulum", "torque"), robot="pendulum", controller=controller, torque_unit="Nm"
    )
    assert seen(recording) == (pytest.approx(INERTIA, rel=0.1), pytest.approx(WEIGHT, rel=0.1))
    assert set(recording.description.unknown) == {"mass", "reflected_inertia"}


def test_a_free_swing_shows_their_ratio(tmp_path: Path) -> None:
    log = played("pendulum", "free")
    recording = imported(
        tmp_path, {"time": log["time"], "angle": log["position"]}, robot="pendulum", controller={"mode": "free"}
    )
    inertia, weight = seen(recording)
    assert weight / inertia == pytest.approx(WEIGHT / INERTIA, rel=0.05)


def test_where_the_pendulum_hangs_is_seen_and_said(tmp_path: Path) -> None:
    recording = imported(tmp_path, played("pendulum", hangs_at=0.6), robot="pendulum", controller={"kp": KP})
    still = np.zeros((1, 1))
    hanging = recording.rigid_body().inverse_dynamics(np.full((1, 1), 0.6), still, still, recording.gravity)
    assert abs(hanging[0, 0]) < 0.1 * WEIGHT
    assert any("the pendulum hangs down at 0.5" in line for line in recording.description.doubts)


def test_a_stated_mass_and_lever_tell_the_gain(tmp_path: Path) -> None:
    recording = imported(tmp_path, played("pendulum"), robot="pendulum", mass=MASS, lever=LEVER)
    assert "mass" not in recording.description.unknown
    assert float(recording.gains.kp[0]) == pytest.approx(KP, rel=0.15)


def test_a_weight_that_is_not_there_is_doubted(tmp_path: Path) -> None:
    recording = imported(tmp_path, played("wheel"), robot="pendulum", controller={"kp": KP})
    assert any("source.robot=wheel" in line for line in recording.description.doubts)


def test_guesses_a_third_off_are_fitted_back_to_the_noise(tmp_path: Path) -> None:
    logs = [played("pendulum", seed=seed) for seed in range(4)]
    for seed, log in enumerate(logs):
        polars.DataFrame(log).write_csv(tmp_path / f"run_{seed}.csv")
    given = {"files": [f"{tmp_path}/run_*.csv"], "read": "after", "robot": "pendulum", "controller": {"kp": KP}}
    write_recordings(tmp_path / "out", recording_tables(source_settings("csv", given), "csv", 0))
    urdf = tmp_path / "out" / "rig.urdf"
    mass = float(urdf.read_text().partition('mass value="')[2].partition('"')[0])
    urdf.write_text(urdf.read_text().replace(f'mass value="{mass:.9g}"', f'mass value="{0.7 * mass:.9g}"'))
    search, _ = divided(read_recording(tmp_path / "out"), (), 0, lambda line: None)
    assert [term.label for term in search.start.terms] == ["payload@pendulum"]
    base = search.base
    assert base.judgement.error < 1.2
    assert 0.7 * mass + base.fit.model.terms[0].values["mass"] == pytest.approx(mass, rel=0.1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "either source.urdf=... .* or, for one joint without one, source.robot=pendulum|wheel|slide"),
        ({"robot": "pendulum", "urdf": "a.urdf"}, "either source.urdf"),
        ({"robot": "pendulm"}, "source.robot=pendulm: unknown; choose one of pendulum, wheel, slide"),
        ({"robot": "wheel", "mass": -1.0}, "source.mass=-1.0: expected greater than 0"),
        ({"robot": "wheel", "gain": 16}, "source.gain=16: is that of source.servo=NAME, which is not given"),
        ({"robot": "wheel", "rate": "fast"}, "source.rate=fast: expected a valid number"),
        ({"robot": "wheel", "gravity": 9.81}, "source.gravity=9.81: expected a valid tuple"),
        ({"robot": "wheel", "gravity": [0.0, 0.0]}, r"source.gravity=\[0.0, 0.0\]: expected more values"),
        ({"robot": "wheel", "resolution": -1.0}, "source.resolution=-1.0: expected greater than or equal to 0"),
        ({"robot": "wheel", "controller": {"kt": 0.1}}, "controller.mode=position: kt and R are of mode=voltage"),
        ({"robot": "wheel", "read": "behind"}, "source.read=behind: expected 'before' or 'after'"),
        ({"robot": "wheel", "controller": {"kp": "abc"}}, "source.controller.kp=abc: expected a valid number"),
        ({"robot": "wheel", "length": -1}, "source.length=-1: expected greater than 0"),
        (
            {"robot": "wheel", "angle_unit": "degrees"},
            "unknown; choose one of rad, deg, turn, mrad, range .* or the ticks",
        ),
        ({"robot": "wheel", "servo": "sts3251"}, "source.servo=sts3251: unknown.*did you mean sts3215"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, played("wheel"), **settings)


def test_constants_of_a_servo_are_stated_where_nobody_says_others(tmp_path: Path) -> None:
    recording = imported(tmp_path, played("pendulum"), robot="pendulum", servo="sts3215", controller={"kd": 0.3})
    stall = 7.4 * 1.178 / 2.479  # as Rhoban/bam publishes kt and R
    assert float(recording.gains.kp[0]) == pytest.approx(16 * 0.1668 * stall, rel=1e-3)
    assert float(recording.gains.torque_limit[0]) == pytest.approx(0.97 * stall, rel=1e-3)
    assert recording.gains.kd.tolist() == [0.3]
    assert recording.nominal["reflected_inertia"].tolist() == [0.0261]
    assert recording.description.unknown == ["reflected_inertia", "mass"]
    weighed = imported(
        tmp_path / "weighed", played("pendulum"), robot="pendulum", mass=0.4, servo="sts3215", controller={}
    )
    assert weighed.description.unknown == ["kp", "kd", "reflected_inertia"]


def test_the_gain_of_the_firmware_counts() -> None:
    assert set(servos()) == {"sts3215", "sts3215_12v", "xl330"}
    for name in servos():
        servo = read_servo(name)
        assert servo.constants(2 * servo.gain)["kp"] == pytest.approx(2 * servo.constants(None)["kp"], rel=1e-3)
