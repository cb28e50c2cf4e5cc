"""The published data sets become recordings that are read without errors; skipped where they are not at hand."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from benchmarks.real_machines.__main__ import KEY, MACHINES, judged
from benchmarks.real_machines.bam_xl330 import BamXl330, stiffness
from benchmarks.real_machines.dfki_double import DfkiDouble
from benchmarks.real_machines.dfki_pendulum import DfkiPendulum
from benchmarks.real_machines.emps import Emps
from benchmarks.real_machines.shadow_lfj3 import ShadowLfj3
from benchmarks.real_machines.so101_sage import So101Sage
from benchmarks.real_machines.tx40 import Tx40
from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.errors import InputError
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.source import Source

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data")


def imported(source: Source, folder: Path) -> dict[str, Recording]:
    recordings = {}
    for name, tables in source.recordings(0).items():
        write_recording(folder / name, tables)
        recordings[name] = read_recording(folder / name)
    return recordings


@needs_data
def test_bam_holds_one_gain_out_and_drops_what_came_after_switching_off(tmp_path: Path) -> None:
    parts = imported(BamXl330(str(DATA / "bam_xl330" / "xl330.npz")), tmp_path)
    assert len(parts[""].trials) == 12
    assert len(parts["validation"].trials) == 4
    assert {round(t.gains.kp[0] / stiffness(1)) for t in parts[""].trials} == {100, 400, 800}
    dropped = next(t for t in parts[""].trials if t.name.startswith("lift_and_drop"))
    assert dropped.duration < 5.0


@needs_data
def test_shadow_sweeps_are_cut_into_segments_of_commanded_torque(tmp_path: Path) -> None:
    parts = imported(ShadowLfj3(str(DATA / "shadow_lfj3" / "lfj3_openloop.npz")), tmp_path)
    recording = parts[""]
    assert recording.torque_controlled
    assert all(trial.duration == pytest.approx(0.399, abs=0.003) for trial in recording.trials)
    assert np.abs(recording.trials[20].command).max() < 0.2


@needs_data
def test_so101_repeats_give_a_noise_floor(tmp_path: Path) -> None:
    source = So101Sage(str(DATA / "so101_sage"), joint="Rotation", motions=("repetitive_motion",))
    floor = noise_floor(imported(source, tmp_path)[""])
    assert floor.source == "repeats"
    assert floor.repeats >= 8
    assert 0.0005 < floor.overall < 0.006


@needs_data
def test_what_somebody_pushed_by_hand_is_no_trial_of_the_pendulum(tmp_path: Path) -> None:
    parts = imported(DfkiPendulum(str(DATA / "dfki_pendulum" / "dfki_pendulum.npz")), tmp_path)
    assert all(recording.torque_controlled for recording in parts.values())
    swings = [trial for trial in parts[""].trials if trial.kind == "energy_shaping"]
    assert len(swings) == 7, "seven seconds before somebody pushes, of one each"
    assert len([entry for entry in parts[""].description.trials if entry.kind == "energy_shaping"]) == 20
    assert {trial.kind for trial in parts["validation"].trials} == {"sac"}
    assert {trial.kind for trial in parts["heavier"].trials} == {"energy_shaping_1kg"}


@needs_data
def test_the_arms_joint_6_is_freed_from_joint_5_and_friction_brakes_every_joint(tmp_path: Path) -> None:
    recording = imported(Tx40(str(DATA / "tx40")), tmp_path)[""]
    assert recording.rate == 500.0
    raw = np.load(DATA / "tx40" / "tx40.npz")["position_deg"]
    first = recording.trials[0].position[0]
    assert first[5] == pytest.approx(np.radians(raw[0, 5] - raw[0, 4]), abs=1e-3)
    power = sum(
        np.sum(np.sign(trial.velocity()) * np.where(np.abs(trial.velocity()) > 0.2, trial.command, 0), axis=0)
        for trial in recording.trials
    )
    assert (power > 0).all()


def test_a_missing_archive_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.npz: no such file"):
        BamXl330(str(tmp_path / "none.npz")).recordings(0)


@needs_data
def test_emps_is_cut_into_its_periods_and_the_pulses_stay_whole(tmp_path: Path) -> None:
    parts = imported(Emps(str(DATA / "emps")), tmp_path)
    assert [round(trial.duration, 1) for trial in parts[""].trials] == [6.2, 6.2, 6.2, 6.2]
    assert parts["validation"].trials[0].duration == pytest.approx(24.84)
    assert parts[""].torque_controlled
    assert parts[""].units == {"slide": "m"}


@needs_data
def test_the_double_pendulum_hangs_as_its_owners_say(tmp_path: Path) -> None:
    recording = imported(DfkiDouble(str(DATA / "dfki_double")), tmp_path)[""]
    mass = recording.rigid_body().actuated_mass_matrix(np.array([0.0, np.pi / 2]))
    assert mass[1, 1] == pytest.approx(0.05087, rel=1e-3), "I2 about joint 2"
    assert mass[0, 0] == pytest.approx(0.03189 + 0.05087 + 0.6256 * 0.2**2, rel=1e-3)


def test_the_key_names_every_machine_and_its_effects_exist() -> None:
    key = yaml.safe_load(KEY.read_text())
    assert list(key) == list(MACHINES)
    names = [name for one in key.values() for line in (*one["named"], one.get("not_named", [])) for name in line]
    assert {name.partition("@")[0] for name in names} <= set(catalogue())


def test_a_documented_effect_counts_wherever_it_is_named_and_an_absent_one_is_said() -> None:
    key = {"named": [["backlash"], ["coulomb_friction@q1"]], "not_named": ["cogging"]}
    assert judged({"named": ["backlash@q2"], "sets": []}, key) == "1 of 2"
    assert judged({"named": [], "sets": [["coulomb_friction@q1"], ["cogging@q1"]]}, key) == "1 of 2, wrongly cogging"
