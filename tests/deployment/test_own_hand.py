"""A policy of a hand with other numbers of fingers and joints, from its file to the log of the loop."""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import tactile_cube
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, save_policy
from tactile_cube.api.deployment import robot_limits
from tactile_cube.deployment.training_setting import training_setting
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_hand import DESCRIPTIONS
from tests.meshes import CUBE, write_obj
from tests.own_hands import description

HAND = {"_target_": "tactile_cube.hand.hand_from_urdf", **description(("left", "right"), name="two_fingers")}
OBJECT = {"shape": "cylinder", "size": [0.07, 0.07, 0.06], "mass": 0.08}
ENV: dict[str, Any] = {
    "hand": HAND,
    "constants": {"_target_": "tactile_cube.simulation.constants_of", "hand": HAND, "object": OBJECT, "kd": 0.3},
    "task": {"_target_": "tactile_cube.env.Task", "name": "table", "table": True, "direction": -1, "axis": "z"},
}
JOINTS = 8  # two fingers with four joints each


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    """An untrained policy, as training would write it."""
    torch.manual_seed(0)
    actor = Actor(Sizes(5 * 2 * JOINTS, 0, JOINTS), (16, 16))
    info = PolicyInfo.describe(actor, time_constant=0.2, config={"env": ENV})
    save_policy(tmp_path / "policy.safetensors", actor, info)
    return tmp_path / "policy.safetensors"


def test_its_contract_has_its_joints_gains_object_and_the_start_around_it(policy: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="from the policy's file alone; name the hand: hand=two_fingers"):
        tactile_cube.export(policy, tmp_path / "two.npz")
    changed = {"hand.name": "two_fingers", "~hand.fingers.thumb": None}
    written = tactile_cube.export(policy, tmp_path / "two.npz", hand="three_finger", values=changed)
    contract = json.loads(written.read_text())
    assert len(contract["joints"]) == len(contract["start_angles"]["angles"]) == JOINTS
    assert contract["observation"]["shape"] == ["batch", 80]
    assert (contract["impedance"]["kp"]["value"], contract["impedance"]["kd"]["value"]) == (3.0, 0.3)
    assert contract["task"]["object"]["shape"] == "cylinder"
    assert (contract["task"]["on_a_table"], contract["task"]["direction"]) == (True, -1)
    setting = training_setting({"config": {"env": ENV}})
    tips = np.stack(
        [setting.hand.finger_tips(k, setting.hand.start_angles[None][:, 4 * k : 4 * k + 4]) for k in (0, 1)]
    )
    off = np.linalg.norm(tips[:, 0, :2], axis=1) - 0.5 * 0.07 - setting.hand.tip_radius
    np.testing.assert_allclose(off, 0.001, atol=2e-4)


@pytest.mark.timeout(300)
def test_a_dry_run_has_its_object_and_table_and_its_log_is_one_that_compare_reads(policy: Path, tmp_path: Path) -> None:
    lines: list[str] = []
    done = tactile_cube.deploy(policy, seconds=0.5, values={"homing.settle": 0.1}, say=lines.append)
    assert done.runs[0].reason == "time is over"
    assert np.isfinite(done.turned).all()
    assert "running: the policy decides; let go of the object" in lines
    values = {"homing.settle": 0.1, "robot.cube": False}
    alone = tactile_cube.deploy(policy, motion="multisine", seconds=1.5, runs=2, values=values, say=lines.append)
    assert lines.count("running: an excitation, no policy") == 2
    recording = alone.write(tmp_path / "log")
    assert recording is not None
    compared = tactile_cube.compare(recording, step=0.001, values={"band.simulations": 0}, say=lines.append)
    assert len(compared.comparison.recording.joints) == JOINTS
    assert compared.error < 1.5 * compared.noise_floor
    spread = np.ptp(compared.comparison.recording.trials[0].position, axis=0)
    assert spread.min() > 0.03


def test_a_hand_moves_without_a_policy_but_not_with_that_of_another() -> None:
    def quiet(line: str) -> None:
        """Takes progress."""

    done = tactile_cube.deploy(None, hand="three_finger", motion="holds", filter_time=0.1, seconds=0.2, say=quiet)
    assert done.hand.name == "three_finger"
    assert len(done.logs[0])
    with pytest.raises(InputError, match="hand=three_finger: the policy was trained on dlr_hand2"):
        tactile_cube.deploy(None, hand="three_finger", say=quiet)


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A policy of a hand and an object in files of its owner's, in the folder where commands are typed."""
    monkeypatch.chdir(tmp_path)
    urdf = (DESCRIPTIONS / "three_finger.urdf").read_bytes()
    Path("mine.urdf").write_bytes(urdf)
    write_obj(tmp_path, 0.07 * CUBE)
    hand = HAND | description() | {"urdf": "mine.urdf", "sha256": hashlib.sha256(urdf).hexdigest()}
    constants = {"object": {"shape": "mesh", "file": "object.obj", "mass": 0.05}}
    actor = Actor(Sizes(120, 0, 12), (8,))
    info = PolicyInfo.describe(actor, time_constant=0.2, config={"env": {"hand": hand, "constants": constants}})
    save_policy(Path("policy.safetensors"), actor, info)
    return Path("policy.safetensors")


def test_a_policy_of_files_elsewhere_wants_them_named_and_knows_its_urdf(elsewhere: Path) -> None:
    hand: Any = {"hand": "three_finger", "hand.urdf": "mine.urdf"}
    object_: Any = {"object": "mesh", "object.file": "object.obj"}
    with pytest.raises(InputError, match=r"env\.hand\.urdf is 'mine\.urdf'.* choose it yourself: hand="):
        tactile_cube.export(elsewhere, "own.npz", values=object_)
    with pytest.raises(InputError, match=r"env\.constants\.object\.file is .* choose it yourself: object="):
        tactile_cube.export(elsewhere, "own.npz", values=hand)
    contract = json.loads(tactile_cube.export(elsewhere, "own.npz", values=hand | object_).read_text())
    assert contract["hand"]["urdf"] == {
        "file": "mine.urdf",
        "sha256": hashlib.sha256(Path("mine.urdf").read_bytes()).hexdigest(),
    }
    assert contract["task"]["object"]["shape"].startswith("mesh")
    Path("mine.urdf").write_text(Path("mine.urdf").read_text() + "\n")
    with pytest.raises(InputError, match="its URDF has the SHA-256"):
        tactile_cube.deploy(elsewhere, seconds=0.1, values=hand | object_, say=lambda line: None)


def test_a_robot_is_not_driven_by_limits_that_only_the_policy_states(policy: Path) -> None:
    topics = {"robot.states": "/states", "robot.commands": "/commands"}
    with pytest.raises(InputError, match="what the drives of hand 'two_fingers' bear"):
        tactile_cube.deploy(policy, robot="ros2", values=topics, say=lambda line: None)


@pytest.mark.parametrize("drives", [{"torque_limit": 1.1}, {"kp": 1e-9}, {"kp": 9.0}, {"kd": [0.3] * 7 + [1e3]}])
def test_a_file_cannot_widen_the_limits_of_a_hand(drives: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=rf"env\.constants\.{next(iter(drives))} is .*, the hand's is"):
        training_setting({"config": {"env": ENV | {"constants": ENV["constants"] | drives}}})


@pytest.mark.parametrize("size", [5.0, [0.08, 5.0, 0.08], 0.3])
def test_an_object_out_of_the_fingers_reach_is_refused(size: Any) -> None:
    env: dict[str, Any] = {"constants": {"object": {"size": size}}}
    with pytest.raises(InputError, match=r"the object is .* m; .* mm off its side, allowed 10 mm"):
        training_setting({"config": {"env": env}})
    assert training_setting({"config": {"env": {"constants": {"object": {"size": 0.15}}}}}).constants is not None


def test_the_limits_of_a_softer_training_are_the_hands() -> None:
    soft = {"kp": 2.0, "torque_limit": 0.8}
    setting = training_setting({"config": {"env": ENV | {"constants": ENV["constants"] | soft}}})
    limits = robot_limits(setting, 6.0)
    assert (limits.kp.min(), limits.torque) == (3.0, 0.8)


def test_a_file_that_names_what_is_no_constant_is_refused() -> None:
    with pytest.raises(InputError, match=r"env\.constants\.cube_colour, which this version does not know"):
        training_setting({"config": {"env": {"constants": {"cube_colour": "red"}}}})
