"""Sensors on links, and torques that a controller adds to its own: as columns of a recording, and in its simulation."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.errors import InputError
from tactile_cube.identification.fitting.problem import Problem, Shooting
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.comparing.noise_floor import noise_with_links
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tests.measurement.small_rig import Table, write

NOISE, ZERO, COMPLIANCE = 1e-4, 0.3, 0.04


def with_links(folder: Path, more: float = 0.0) -> Recording:
    """The link of joint a is behind its motor by what the drive's torque bends it, and its sensor has its own zero."""

    def spoil(columns: Table) -> None:
        rng = np.random.default_rng(5)
        bent = columns["a.position"] - (COMPLIANCE + more) * columns["a.torque"] + ZERO
        columns["a.link_position"] = bent + NOISE * rng.normal(size=len(bent))

    return read_recording(write(folder, lambda data: data["sensors"].update(read="before"), spoil))


def test_a_link_column_is_read_and_its_noise_found(tmp_path: Path) -> None:
    recording = with_links(tmp_path)
    first, second = recording.trials
    assert first.link_position is not None
    assert list(first.linked) == [0]
    assert list(second.linked) == []
    assert list(recording.linked) == [0]
    noise = noise_with_links(recording)
    assert noise[2] > NOISE
    assert np.isnan(noise[3])


def test_a_hole_in_a_link_column_is_an_error_that_names_the_row(tmp_path: Path) -> None:
    def spoil(columns: Table) -> None:
        columns["a.link_position"] = np.where(np.arange(len(columns["time"])) == 7, np.nan, 0.0)

    with pytest.raises(InputError, match=r"first.parquet: column 'a.link_position', row 7: received nan"):
        read_recording(write(tmp_path, spoil=spoil))


def test_what_a_link_is_behind_its_motor_is_simulated_whatever_its_zero(tmp_path: Path) -> None:
    recording = with_links(tmp_path)
    model = nominal_model(recording)
    shooting = Shooting(recording, ())
    windows = shooting.cut(recording, noise_with_links(recording))
    assert windows.measured.shape[2] == 3
    assert list(windows.joint_of) == [0, 1, 0]
    assert np.all(windows.weight[windows.trial == 1, :, 2] == 0.0)
    own = windows.trial == 0
    bent = {}
    for compliance in (0.02, 0.08):
        softer = replace(model, constants={**model.constants, "stiffness": np.full(2, 1.0 / compliance)})
        shown = shooting.positions([softer], windows)[0][own]
        ahead = shown[..., 2] - shown[..., 0]
        measured = (windows.measured[..., 2] - windows.measured[..., 0])[own]
        seen = windows.weight[own][..., 2] > 0.0
        assert ahead[seen].mean() == pytest.approx(measured[seen].mean(), abs=1e-9)
        bent[compliance] = float(ahead[seen].std())
    assert bent[0.08] > 3.0 * bent[0.02]


def test_the_sensor_on_a_link_tells_how_soft_its_drive_is(tmp_path: Path) -> None:
    widths = []
    for folder, links in ((tmp_path / "with", True), (tmp_path / "without", False)):
        recording = with_links(folder)
        if not links:
            recording = recording.with_trials([replace(trial, link_position=None) for trial in recording.trials])
        shooting = Shooting(recording, ())
        problem = Problem(shooting, shooting.cut(recording, noise_with_links(recording)))
        model = nominal_model(recording)
        problem.linearise_starts(model)
        column = problem.columns(model, [Unknown("constant", "stiffness", 0, 1.0, 1e6, 1.0)])[1]
        freed = problem.free(column)
        widths.append(float(np.sum(column * freed)) ** -0.5)
    assert widths[0] < 0.8 * widths[1]


def test_a_feed_forward_torque_acts_like_a_command_that_asks_for_it(tmp_path: Path) -> None:
    added = 0.1

    def feed(columns: Table) -> None:
        columns["a.feedforward"] = np.full(len(columns["time"]), added)

    def ask(columns: Table) -> None:
        columns["a.command"] = columns["a.command"] + added / 3.0

    shown = []
    for name, spoil in (("fed", feed), ("asked", ask)):
        recording = read_recording(write(tmp_path / name, spoil=spoil))
        shown.append(free_run(recording, nominal_model(recording))[0].position)
    assert np.array_equal(*shown)


def test_a_link_that_moves_by_another_unit_is_an_error_that_says_the_factor(tmp_path: Path) -> None:
    def degrees(columns: Table) -> None:
        columns["a.link_position"] = np.degrees(columns["a.position"])

    with pytest.raises(InputError, match=r"column 'a.link_position' moves 57.3 times as far as 'a.position'"):
        read_recording(write(tmp_path, spoil=degrees))
