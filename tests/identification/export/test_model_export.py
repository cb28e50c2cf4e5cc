"""Models written for other simulators: played in MuJoCo, and what a format has no place for."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import tactile_cube
from tactile_cube.drivetrain.model_file import ModelFile, write_model
from tactile_cube.errors import InputError
from tactile_cube.export import main
from tactile_cube.hand.mjcf import read_mjcf
from tactile_cube.identification.export import drives_of
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.trial import Trial
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run

ARM = """<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0.08 0 0"/><mass value="0.3"/>
<inertia ixx="1e-4" iyy="6e-4" izz="6e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-1.9" upper="1.9" effort="3" velocity="9"/>
</joint></robot>"""
HELD = [
    {"effect": "viscous_friction@elbow", "parameters": {"damping": 0.05}},
    {"effect": "command_delay@elbow", "parameters": {"delay": 0.0137}},
    {"effect": "torque_bias@elbow", "parameters": {"bias": 0.02}},
    {"effect": "torque_gain@elbow", "parameters": {"error": 0.1}},
    {"effect": "payload@elbow", "parameters": {"mass": 0.05, "distance": 0.1}},
]
SUPPLY = [{"effect": "back_emf@elbow", "parameters": {"stall": 0.6, "no_load": 5.0}}, HELD[0]]
RATE = {"effect": "rate_limit@elbow", "parameters": {"speed": 0.8}}


def model(*effects: dict[str, object], **values: float) -> ModelFile:
    given = {"kp": 6.0, "kd": 0.25, "torque_limit": 0.9, "static_friction": 0.03, "reflected_inertia": 0.004} | values
    rows = {key: {"elbow": value} for key, value in given.items()}
    return ModelFile.model_validate({"rig": "arm", "joints": ["elbow"], "values": rows, "effects": list(effects)})


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """An arm with play in its gear, which no format and no model here has."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "arm.urdf").write_text(ARM)
    arm = {
        "source.urdf": folder / "arm.urdf", "source.controller.kp": 6, "source.controller.kd": 0.25,
        "source.nominal.stiffness": math.inf, "source.kinds": ["ramps", "multisine"], "source.initialisations": 1,
        "source.offset": 0, "source.duration": 3, "source.validation": False,
        "source.hidden": ["backlash@elbow: play=0.02"],
    }  # fmt: skip
    return tactile_cube.record(folder / "recording", source="rig", values=arm)[""]


def played(text: str, trial: Trial, recording: Recording, stiffness: float) -> NDArray[np.float64]:
    """Positions of the motors that MuJoCo makes of a trial's commands (n, joints) [rad]."""
    spec = mujoco.MjModel.from_xml_string(text)
    data, steps = mujoco.MjData(spec), round(recording.step / spec.opt.timestep)
    data.qpos[:] = trial.position[0]
    data.act[:] = trial.command[0]
    for k in np.flatnonzero(spec.actuator_delay):
        past = np.full((spec.actuator_history[k, 0], 1), trial.command[0, 0])
        mujoco.mj_initCtrlHistory(spec, data, k, None, past)
    found = []
    for command in trial.command:
        data.ctrl[:] = command
        mujoco.mj_step(spec, data, steps)
        found.append(data.qpos + data.actuator_force / stiffness)
    return np.array(found)


@pytest.mark.parametrize(
    ("effects", "stiffness"),
    [(HELD, np.inf), (SUPPLY, np.inf), ([*SUPPLY, HELD[1], RATE], np.inf), ([RATE], np.inf), (HELD[:3], 25.0)],
    ids=["position", "dcmotor", "servo", "rate", "elastic"],
)
def test_mujoco_plays_the_file_as_far_from_the_machine_as_our_simulator(
    effects: list[dict[str, object]], stiffness: float, recording: Recording, tmp_path: Path
) -> None:
    known = model(*effects, stiffness=stiffness)
    made = tactile_cube.export_model(known, "mjcf", tmp_path / "arm.xml", recording=recording)
    assert made.not_held == ([] if stiffness == np.inf else ["elbow: stiffness 25 N m/rad"])
    text = made.output.read_text()
    ours = [one.position for one in free_run(recording, nominal_model(recording, known), step=0.0005)]
    theirs = [played(text, trial, recording, stiffness) for trial in recording.trials]
    measured = [trial.position for trial in recording.trials]
    errors = [
        np.sqrt(np.mean(np.concatenate([a - b for a, b in zip(measured, run, strict=True)]) ** 2))
        for run in (ours, theirs)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.1)
    assert np.sqrt(np.mean(np.concatenate([a - b for a, b in zip(ours, theirs, strict=True)]) ** 2)) < 0.1 * errors[0]


def test_a_motors_voltage_gets_a_dcmotor_with_its_back_emf(recording: Recording, tmp_path: Path) -> None:
    controller = recording.description.controller.model_copy(update={"mode": "voltage"})
    driven = replace(recording, description=recording.description.model_copy(update={"controller": controller}))
    known = model(HELD[3], torque_limit=np.inf, static_friction=0.0)
    made = tactile_cube.export_model(known, "mjcf", tmp_path / "arm.xml", recording=driven)
    spec = mujoco.MjModel.from_xml_path(str(made.output))
    data = mujoco.MjData(spec)
    data.ctrl[:], data.qvel[:] = 0.4, 2.0
    mujoco.mj_forward(spec, data)
    assert data.qfrc_actuator == pytest.approx(1.1 * 0.4 - 1.1 * 0.25 * 2.0)
    assert made.not_held == []


def test_the_file_read_again_states_the_same_drive(recording: Recording, tmp_path: Path) -> None:
    made = tactile_cube.export_model(model(*HELD[:2]), "mjcf", tmp_path / "arm.xml", recording=recording)
    stated = {key: row["elbow"] for key, row in read_mjcf(made.output).stated.items()}
    assert stated == pytest.approx({
        "kp": 6.0, "kd": 0.25, "torque_limit": 0.9, "static_friction": 0.03, "reflected_inertia": 0.004,
        "viscous_friction": 0.05,
    })  # fmt: skip


def test_commanded_torques_get_a_motor_with_the_gain_as_its_gear(recording: Recording, tmp_path: Path) -> None:
    controller = recording.description.controller.model_copy(update={"mode": "torque"})
    pushed = replace(recording, description=recording.description.model_copy(update={"controller": controller}))
    made = tactile_cube.export_model(model(HELD[2], HELD[3]), "mjcf", tmp_path / "arm.xml", recording=pushed)
    spec = mujoco.MjModel.from_xml_path(str(made.output))
    data = mujoco.MjData(spec)
    data.ctrl[:] = 5.0
    mujoco.mj_forward(spec, data)
    assert data.qfrc_actuator == pytest.approx(1.1 * 0.9)
    assert made.not_held == ["elbow: bias 0.02 N m"]


def test_what_mjcf_has_no_place_for_is_on_the_screen_and_in_the_file(recording: Recording, tmp_path: Path) -> None:
    known = model(
        {"effect": "stribeck_friction@elbow", "parameters": {"excess": 0.02, "velocity": 0.2}},
        {
            "effect": "backlash@elbow",
            "parameters": {"play": {"value": 0.02, "low": 0.019, "high": 0.021, "unit": "rad"}},
        },
        stiffness=25.0,
    )
    made = tactile_cube.export_model(known, "mjcf", tmp_path / "arm.xml", recording=recording)
    for words in ("elbow: excess 0.02 N m", "elbow: backlash play 0.02 rad", "elbow: stiffness 25"):
        assert any(line.startswith(words) for line in made.not_held)
        assert words in made.text
        assert words in made.output.read_text()


def test_a_number_that_may_be_nothing_is_not_missed() -> None:
    unsure = {"value": 1e-5, "low": -1e-4, "high": 1e-4}
    viscous = {"effect": "viscous_friction@elbow", "parameters": {"damping": 0.05, "difference": unsure}}
    (drive,) = drives_of(model(viscous))
    assert (drive.damping, drive.beyond) == (0.05, {})


def test_a_urdf_gets_friction_damping_and_effort(recording: Recording, tmp_path: Path) -> None:
    made = tactile_cube.export_model(model(HELD[0]), "urdf", tmp_path / "arm.urdf", recording=recording)
    joint = ElementTree.parse(made.output).getroot().find("joint")
    assert joint is not None
    assert joint.find("dynamics").attrib == {"damping": "0.05", "friction": "0.03"}  # type: ignore[union-attr]
    assert joint.find("limit").get("effort") == "0.9"  # type: ignore[union-attr]
    assert "elbow: armature 0.004 kg m^2" in made.not_held


def test_bam_gets_its_own_names_and_the_motor_that_has_these_gains(tmp_path: Path) -> None:
    stribeck = {"effect": "stribeck_friction@elbow", "parameters": {"excess": 0.02, "velocity": 0.2, "exponent": 1.5}}
    bam = {"bam.actuator": "sts3215", "bam.volts": 40}
    made = tactile_cube.export_model(model(stribeck, *HELD[:2], RATE), "bam", tmp_path / "arm.json", values=bam)
    data = json.loads(made.output.read_text())
    assert made.not_held == data.pop("not_held") == ["elbow: torque_limit 0.9 N m"]
    kt, resistance = data.pop("kt"), data.pop("R")
    assert 40.0 * kt / resistance == pytest.approx(6.0)  # torque of an error of 1 rad
    assert kt**2 / resistance == pytest.approx(0.25)  # back-EMF
    assert data == {
        "model": "m2", "actuator": "sts3215", "armature": 0.004, "friction_base": 0.03, "friction_viscous": 0.05,
        "command_delay": 0.0137, "max_velocity": 0.8, "friction_stribeck": 0.02, "dtheta_stribeck": 0.2, "alpha": 1.5,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("folder", "said"),
    [
        ("../elsewhere", "lies outside of"),
        ("/etc", "lies outside of"),
        ("lost", r"recording 'lost' is not here; give recording=FOLDER"),
        ("", r"is not here; give recording=FOLDER"),
    ],
)
def test_a_model_names_no_recording_outside_of_the_users_folder(folder, said, tmp_path, monkeypatch) -> None:
    (tmp_path / "work").mkdir()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    known = model()
    write_model(
        known.model_copy(update={"provenance": known.provenance.model_copy(update={"recording": folder})}), "m.yaml"
    )
    with pytest.raises(InputError, match=said):
        tactile_cube.export_model("m.yaml", "mjcf")
    assert not list(Path().glob("*.xml"))


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"bam.volts": -3}, "bam.volts=-3: expected a number of volts above 0"),
        ({"bam.volts": "many"}, "bam.volts=many: expected a number of volts above 0"),
        ({"policy": "default"}, "policy=default: format=bam is of a model; leave one of them out"),
        ({"output": "."}, r"^output=\.: is a folder; name a file$"),
    ],
)
def test_a_wrong_setting_writes_no_file(settings, said, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=said):
        tactile_cube.export_model(model(), "bam", values={"bam.actuator": "sts3215", **settings})
    assert not list(tmp_path.iterdir())


def test_a_format_without_a_model_is_no_policys(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["export", "format=mjcf", f"hydra.run.dir={tmp_path}"])
    with pytest.raises(SystemExit):
        main()
    assert "format=mjcf: give model=model.yaml" in capsys.readouterr().err
