"""A log with an MJCF file: what the file states of the drives becomes what the recording states."""

from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recordings
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.sources.source import recording_tables, source_settings
from tests.measurement.small_rig import table

ARM = """<mujoco><compiler angle="radian"/><worldbody><body name="upper"><joint name="a" axis="0 1 0" armature="0.003"
frictionloss="0.01" damping="0.04" range="-0.5 0.5"/><inertial pos="0 0 -0.05" mass="0.1" diaginertia="1e-5 1e-5 1e-5"/>
<body name="lower" pos="0 0 -0.1"><joint name="b" axis="1 0 0" range="-0.6 1.5"/><inertial pos="0 0 -0.03" mass="0.05"
diaginertia="1e-5 1e-5 1e-5"/></body></body></worldbody>ACTUATORS</mujoco>"""
POSITION = """<actuator><position joint="a" kp="3" kv="0.2" forcerange="-1 1"/><position joint="b" kp="2" kv="0.1"/>
</actuator>"""
MOTORS = '<actuator><motor joint="a"/><motor joint="b"/></actuator>'


def imported(folder: Path, actuators: str, **said: dict[str, float]) -> Recording:
    (folder / "arm.xml").write_text(ARM.replace("ACTUATORS", actuators))
    polars.DataFrame(table()).write_csv(folder / "log.csv")
    settings = {"files": [str(folder / "log.csv")], "urdf": str(folder / "arm.xml"), **said}
    write_recordings(folder / "out", recording_tables(source_settings("csv", settings), "csv", 0))
    return read_recording(folder / "out")


def test_gains_limits_and_constants_of_the_file_are_stated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = imported(tmp_path, POSITION, controller={"torque_limit": float("inf")})
    assert recording.gains.kp.tolist() == [3.0, 2.0]
    assert recording.gains.kd.tolist() == [0.2, 0.1]
    assert recording.gains.torque_limit.tolist() == [1.0, np.inf]
    assert {key: values.tolist() for key, values in recording.nominal.items()} == {
        "reflected_inertia": [0.003, 0.0],
        "static_friction": [0.01, 0.0],
        "viscous_friction": [0.04, 0.0],
    }
    assert "arm.xml, where you state none" in capsys.readouterr().out


def test_what_the_user_says_counts_more(tmp_path: Path) -> None:
    recording = imported(tmp_path, POSITION, controller={"kp": 4.0}, nominal={"static_friction": 0.02})
    assert recording.gains.kp.tolist() == [4.0, 4.0]
    assert recording.nominal["static_friction"].tolist() == [0.02, 0.02]


def test_stated_damping_is_a_free_effect_of_the_nominal_model(tmp_path: Path) -> None:
    (term,) = nominal_model(imported(tmp_path, POSITION)).terms
    assert (term.label, term.values["damping"], term.fitted) == ("viscous_friction@a", 0.04, ("damping",))


def test_motors_leave_the_gains_unknown(tmp_path: Path) -> None:
    assert imported(tmp_path, MOTORS).description.unknown[:2] == ["kp", "kd"]
    (tmp_path / "torques").mkdir()
    assert imported(tmp_path / "torques", MOTORS, controller={"mode": "torque"}).torque_controlled
