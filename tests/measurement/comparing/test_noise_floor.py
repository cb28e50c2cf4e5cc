from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.measurement.comparing.noise_floor import aligned_repeats, noise_floor, sensor_noise
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tests.measurement.small_rig import setting, table, write


def spoiled(folder: Path, rows: slice, by: float | np.ndarray) -> Recording:
    """The small recording with joint a's position in the first trial changed."""

    def spoil(columns: dict) -> None:
        columns["a.position"][rows] += by

    return read_recording(write(folder, spoil=spoil))


@pytest.mark.parametrize("repeats", [2, 5])
def test_repeats_give_the_sensor_noise_and_not_the_joint_offset(tmp_path: Path, repeats: int) -> None:
    recording = read_recording(write(tmp_path))
    noises = np.random.default_rng(0).normal(scale=2e-4, size=(repeats - 2, *recording.trials[0].position.shape))
    clean = table(noise=0.0)
    position = np.stack([clean["a.position"], clean["b.position"]], axis=1)
    more = [replace(recording.trials[0], name=f"more {k}", position=position + n) for k, n in enumerate(noises)]
    floor = noise_floor(recording.with_trials((*recording.trials, *more)))
    assert floor.source == "repeats"
    assert floor.repeats == repeats
    assert floor.overall == pytest.approx(2e-4, rel=0.1)


def test_two_slow_repeats_scatter_by_the_standard_deviation_of_one(tmp_path: Path) -> None:
    recording, clean = read_recording(write(tmp_path)), table(noise=0.0)
    position = np.stack([clean["a.position"], clean["b.position"]], axis=1)
    wave = 2e-3 * np.sin(np.linspace(0.0, 20.0 * np.pi, len(position)))[:, None]  # too slow for a sensor's white noise
    pair = [replace(recording.trials[0], name=f"{sign:+d}", position=position + sign * wave) for sign in (1, -1)]
    # they differ by 2 x 2e-3 sin, whose mean square 2 (2e-3)^2 is the sum of the variances of both
    assert noise_floor(recording.with_trials(pair)).overall == pytest.approx(2e-3, rel=0.03)


def test_repeats_of_a_simulation_are_no_better_than_their_sensor(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    floor = noise_floor(recording.with_trials([recording.trials[0], replace(recording.trials[0], name="again")]))
    assert floor.source == "repeats"
    assert floor.overall == pytest.approx(2e-4, rel=0.1)


def test_a_repeat_that_starts_later_is_aligned(tmp_path: Path) -> None:
    def spoil(columns: dict) -> None:
        late = table(5, samples=312)
        for name in columns:
            columns[name] = columns["time"] if name == "time" else late[name][12:]

    recording = read_recording(write(tmp_path, spoil=spoil))
    assert len(aligned_repeats(recording.trials)) == 1
    assert noise_floor(recording).overall == pytest.approx(2e-4, rel=0.1)


def test_the_wait_at_the_start_is_no_noise(tmp_path: Path) -> None:
    assert noise_floor(spoiled(tmp_path, slice(5), 0.005)).joints["a"] < 3e-4


def test_another_command_is_no_repeat_and_the_floor_is_a_guess(tmp_path: Path) -> None:
    def spoil(columns: dict) -> None:
        for signal in ("command", "position"):
            columns[f"a.{signal}"] *= 0.5

    floor = noise_floor(read_recording(write(tmp_path, spoil=spoil)))
    assert floor.source == "guess"
    assert floor.overall == pytest.approx(2e-4, rel=0.5)


def test_the_sensors_noise_is_that_of_the_positions_whatever_jumps_there_are(tmp_path: Path) -> None:
    assert sensor_noise(spoiled(tmp_path, slice(None, None, 30), 0.05)) == pytest.approx([2e-4, 2e-4], rel=0.1)


def test_a_sensor_is_no_better_than_its_owner_says_or_than_a_millionth_of_the_motion(tmp_path: Path) -> None:
    def noise(name: str, **sensors: float) -> np.ndarray:
        change = setting({"sensors": sensors})
        recording = read_recording(write(tmp_path / name, change, lambda columns: columns.update(table(noise=0.0))))
        return sensor_noise(recording.with_trials(recording.trials[:1]))

    stated = noise("stated", position_resolution=0.012, position_noise=0.004)
    np.testing.assert_allclose(stated, np.hypot(0.012 / np.sqrt(12.0), 0.004))
    np.testing.assert_allclose(noise("ideal"), 1e-6 * np.array([0.6, 0.8]), rtol=1e-3)


def test_the_floor_is_the_recordings_alone_and_the_step_size_error_stands_beside_it(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path))
    plain, floor = noise_floor(recording), noise_floor(recording, {"a": 4e-4, "b": 0.0})
    assert (floor.overall, floor.joints) == (plain.overall, plain.joints)
    assert floor.step_size == {"a": 4e-4, "b": 0.0}
    assert floor.reachable == pytest.approx(np.hypot(floor.overall, np.sqrt(0.5) * 4e-4))
    assert plain.reachable == plain.overall


def test_the_sensors_noise_stands_beside_the_scatter_of_repeats(tmp_path: Path) -> None:
    floor = noise_floor(spoiled(tmp_path, slice(None), 0.003 * np.sin(np.arange(300) / 20)))  # went another way
    assert floor.source == "repeats"
    assert floor.joints["a"] > 1e-3
    assert floor.sensor["a"] == pytest.approx(2e-4, rel=0.5)
