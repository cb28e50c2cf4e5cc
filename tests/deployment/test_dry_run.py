"""The whole loop against the simulated hand: it turns the cube, its log is a recording, faults of the link stop it."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hydra.utils import instantiate

import tactile_cube
from tactile_cube.composition import composed
from tactile_cube.deployment import simulated_hand
from tactile_cube.deployment.control_loop import Homing
from tactile_cube.deployment.robot import RATE, StopRules
from tactile_cube.deployment.simulated_hand import SimulatedHand
from tactile_cube.hand import DLR_HAND2


def quiet(line: str) -> None:
    """Takes progress."""


@pytest.mark.timeout(900)
def test_the_loop_turns_the_cube_with_jitter_and_lost_messages_too() -> None:
    done = tactile_cube.deploy(None, seconds=3, values={"robot.link.lost": 0.2, "robot.link.jitter": 0.05}, say=quiet)
    assert done.runs[0].reason == "time is over"
    assert done.turned[0] > 0.7
    assert done.runs[0].tick_times["median"] < 0.05
    assert "cube turned" in done.text


@pytest.mark.timeout(900)
def test_the_log_of_a_dry_run_is_a_recording_that_the_model_follows_down_to_the_noise(tmp_path: Path) -> None:
    excited = {"motion": "multisine", "filter_time": 0.1, "reach": 0.12}
    done = tactile_cube.deploy(None, seconds=2.5, runs=2, **excited, values={"robot.cube": False}, say=quiet)
    assert done.turned == []
    recording = done.write(tmp_path / "log")
    assert recording is not None
    compared = tactile_cube.compare(recording, step=0.001, values={"band.simulations": 0}, say=quiet)
    assert compared.comparison.floor.repeats > 0
    assert compared.error < 1.3 * compared.noise_floor
    assert np.ptp(compared.comparison.recording.trials[0].position, axis=0).min() > 0.05
    description = recording / "recording.yaml"
    description.write_text(description.read_text().replace("3.69", "3.3"))
    wrong = tactile_cube.compare(recording, step=0.001, values={"band.simulations": 0}, say=quiet)
    assert wrong.error > 2.0 * compared.error


def test_the_angle_of_the_object_is_kept_as_long_as_a_stop_may_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulated_hand, "LONGEST_STOP", 30)
    hand, turned = SimulatedHand(), [0.0]
    hand.release()
    for _ in range(100):
        hand.send(DLR_HAND2.start_angles + 0.15)
        turned.append(hand.turned(hand.wait()))
    hand.close()
    assert np.unique(turned).size > 50
    assert hand.turned(0.08) == turned[80]
    assert hand.turned(0.05) == hand.turned(0.01) == turned[71], "the oldest that is known"


def test_a_broken_link_stops_the_fingers_and_what_came_before_is_kept() -> None:
    done = tactile_cube.deploy(None, seconds=2, values={"robot.link.lost": 0.9, "stop.silence": 0.01}, say=quiet)
    assert "no measurement for" in done.runs[0].reason


def test_a_signal_ends_all_runs_of_the_command_with_status_130(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "tactile_cube.deploy", "runs=3", "seconds=600", f"hydra.run.dir={tmp_path}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        assert any(line.startswith("running: ") for line in command.stdout)
        command.terminate()
        said = command.stdout.read()
    assert command.returncode == 130
    assert said.startswith("stopped: interrupted by SIGTERM\nrun 0: interrupted by SIGTERM; cube turned")
    assert "run 1" not in said


@pytest.mark.parametrize("value", [-1, math.nan, math.inf])
@pytest.mark.parametrize("key", ["rate_limit", "seconds", "filter_time", "robot.rate", "stop.silence", "homing.speed"])
def test_what_cannot_be_run_is_an_input_error_that_names_the_key(key: str, value: float) -> None:
    with pytest.raises(tactile_cube.InputError, match=f"{key} is {value}; give a finite number"):
        tactile_cube.deploy(None, values={key: value}, say=quiet)


def test_the_contract_states_the_rules_the_rate_and_the_homing_that_the_loop_takes() -> None:
    config = composed("deploy", [])
    assert instantiate(config.stop) == StopRules()
    assert instantiate(config.homing) == Homing()
    assert config.rate_limit == RATE
