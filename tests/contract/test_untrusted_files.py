"""No policy or checkpoint from elsewhere runs, imports or reads anything, whichever command takes it."""

import copy
import hashlib
import io
import os
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import torch
from omegaconf import DictConfig, OmegaConf

import tactile_cube
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, save_policy
from tactile_cube.composition import composed
from tactile_cube.deployment.training_setting import training_setting
from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import HoldPolicy, PolicySource, environment
from tactile_cube.training.checkpoint import FILE, HEAD
from tests.own_hands import description

MARK = "ran"
OPEN = {"_target_": "builtins.open", "file": MARK, "mode": "w"}
IMPORT = {"_target_": "stranger.Harm"}
PACKAGED = {"_target_": "tactile_cube.hand.hand_from_urdf", **description()}
OBJECT = {"shape": "mesh", "file": "secret.obj", "mass": 0.05}
FOREIGN = "no part of an environment"
ELSEWHERE = "none of the package's"


def deep(levels: int) -> Any:
    return [deep(levels - 1)] if levels else OPEN


EVIL: dict[str, tuple[dict[str, Any], str]] = {
    "a class below the hand's": ({"hand": {"_target_": "tactile_cube.hand.published_hand", "x": OPEN}}, FOREIGN),
    "a class among a hand's numbers": ({"hand": PACKAGED | {"drive": {"kp": OPEN}}}, FOREIGN),
    "a class in place of the hand": ({"hand": OPEN}, FOREIGN),
    "a module to import": ({"constants": {"kp": [IMPORT]}}, FOREIGN),
    "a class in a list": ({"randomization": {"cube_position": [OPEN, OPEN, OPEN]}}, FOREIGN),
    "a class in a curtain of lists": ({"constants": {"kp": deep(600)}}, "nested too deeply"),
    "a part as text": ({"constants": f"{{object: {OPEN}}}"}, "valid dictionary"),
    "the target as a list": ({"task": {"_target_": ["builtins.open"], "file": MARK}}, FOREIGN),
    "a module's module": ({"task": {"_target_": "tactile_cube.cli.os.mkdir", "path": MARK}}, FOREIGN),
    "a function of a listed package": ({"task": {"_target_": "tactile_cube.env.task"}}, FOREIGN),
    "an unlisted part of a listed package": ({"task": {"_target_": "tactile_cube.simulation.World"}}, FOREIGN),
    "arguments by place": ({"task": {"_target_": "tactile_cube.env.Task", "_args_": ["full"]}}, "no setting"),
    "a function half called": ({"task": {"_target_": "tactile_cube.env.Task", "_partial_": True}}, "no setting"),
    "what Hydra does with parts": ({"start": {"_recursive_": False}}, "no setting"),
    "a variable of the shell": ({"task": {"name": "${oc.env:HOME}"}}, "something outside"),
    "a key that refers": ({"task": {"${oc.env:HOME}": 1}}, "no setting"),
    "another environment": ({"_target_": "stranger.Harm"}, "_target_"),
    "a key that no environment has": ({"callback": OPEN}, "callback"),
    "a URDF elsewhere": ({"hand": PACKAGED | {"urdf": "secret.urdf"}}, ELSEWHERE),
    "a URDF by a way out of the package": ({"hand": PACKAGED | {"urdf": "../secret.urdf"}}, ELSEWHERE),
    "a mesh elsewhere": ({"constants": {"object": OBJECT}}, ELSEWHERE),
    "grasps elsewhere": ({"start": {"_target_": "tactile_cube.randomization.GraspStarts", "file": MARK}}, ELSEWHERE),
    "a model elsewhere": ({"model": "secret.yaml"}, "valid dictionary"),
    "a mass that is no number": ({"constants": {"cube_mass": float("inf")}}, "finite"),
    "text for a number": ({"task": {"_target_": "tactile_cube.env.Task", "episode_steps": "x" * 99}}, "give int"),
    "too many values": ({"constants": {"kp": [0.0] * 60_000}}, "more than 50000"),
}
"""What is put into the environment of a sound policy, and what is said of it; the last ones only have to be refused."""


@cache
def sound() -> dict[str, Any]:
    config: Any = OmegaConf.to_container(composed("train", ["+experiment=smoke"]), resolve=True)
    return {"env": config["env"]}


def with_evil(name: str) -> dict[str, Any]:
    env = copy.deepcopy(sound()["env"])
    for key, value in EVIL[name][0].items():
        env[key] = env[key] | value if isinstance(value, dict) and isinstance(env.get(key), dict) else value
    return {"env": env}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where commands are typed, with a module that leaves a mark when it is imported, and files of the user's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    Path("stranger.py").write_text(f"open({MARK!r}, 'w')\nclass Harm: pass\n")
    for name in ("secret.urdf", "secret.obj", "secret.yaml"):
        Path(name).write_text("secret")
    return tmp_path


def untouched() -> bool:
    return not Path(MARK).exists() and "stranger" not in sys.modules


@cache
def evaluate() -> DictConfig:
    """Its configuration as it stands."""
    return composed("evaluate", [])


def evaluated(config: dict[str, Any]) -> None:
    """What evaluate and view make of a configuration."""
    environment(copy.deepcopy(evaluate()), PolicySource(HoldPolicy(), "evil", config=config), {})


def deployed(config: dict[str, Any]) -> None:
    """What export and deploy make of it."""
    training_setting({"config": config})


@pytest.mark.parametrize("name", EVIL)
@pytest.mark.parametrize("reader", [evaluated, deployed])
def test_whatever_a_configuration_asks_for_is_refused_before_any_of_it_is_made(reader, name) -> None:
    config = with_evil(name)
    with pytest.raises(InputError, match=EVIL[name][1]) as told:
        reader(config)
    assert untouched()
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 400


@pytest.mark.parametrize("sizes", [{"task": "episode_steps"}, {"start": "poses"}, {"simulation": "substeps"}])
def test_sizes_are_refused_before_anything_is_allocated(sizes: dict[str, str]) -> None:
    config = copy.deepcopy(sound())
    for part, key in sizes.items():
        config["env"][part][key] = 10**15
    with pytest.raises(InputError, match=rf"{key} is {10**15}"):
        evaluated(config)


def test_an_effect_of_its_owner_is_not_imported() -> None:
    for named in (
        {"model": {"joints": ["q2"], "effects": [{"effect": "stranger.Harm@q2"}]}},
        {"effects": ["stranger.Harm"]},
    ):
        config = {"env": sound()["env"] | named}
        with pytest.raises(InputError, match=r"own_effects=\[stranger\.Harm\]"):
            evaluated(config)
    assert untouched()


def test_the_name_of_an_effect_does_not_make_a_loaded_package_import_another(monkeypatch: pytest.MonkeyPatch) -> None:
    lazy = ModuleType("lazy")
    lazy.__getattr__ = lambda name: os.mkdir(MARK)  # type: ignore[method-assign]
    monkeypatch.setitem(sys.modules, "lazy", lazy)
    with pytest.raises(InputError, match="'lazy' has no subclass of Effect named 'part'"):
        find_effect("lazy.part")
    assert untouched()


def test_who_has_the_files_names_them(folder: Path) -> None:
    """The same policy is read where the user names the hand, the object and the grasps."""
    config = with_evil("a mesh elsewhere")
    config["env"]["hand"] = PACKAGED | {"urdf": "secret.urdf"}
    config["env"]["start"] = {"_target_": "tactile_cube.randomization.GraspStarts", "file": "secret"}
    named = {"hand": "three_finger", "object": "box", "start": "wide_yaw"}
    made = environment(
        composed("evaluate", [f"{group}={option}" for group, option in named.items()]),
        PolicySource(HoldPolicy(), "own", config=config),
        named,
    )
    assert (made.hand.name, str(made.constants.object_shape)) == ("three_finger", "box")


def policy(path: Path, config: dict[str, Any], damage: str = "") -> Path:
    """A policy, sound but for its configuration and a damage."""
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 0, 12), (8,))
    save_policy(path, actor, PolicyInfo.describe(actor, time_constant=0.5, config=config))
    content = bytearray(path.read_bytes())
    if damage:
        content[-5] ^= 1
        path.write_bytes(content)
    return path


RUN = ["collector=single", "collector.worlds=1", "hydra.run.dir=next"]
COMMANDS = {
    "evaluate": ["policy=evil.safetensors", "protocol=smoke"],
    "view": ["run=evil.safetensors", "viewer=none"],
    "export": ["policy=evil.safetensors"],
    "deploy": ["policy=evil.safetensors", "seconds=0.1"],
    "average": ["run=run", "last=1"],
    "train": ["+experiment=smoke", "training.init_from=evil.safetensors", *RUN],
}
MAKING = ("evaluate", "view", "export", "deploy")
"""Commands that make something of a policy's configuration; the others only keep it."""


def typed(
    name: str, words: list[str], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> tuple[int, str]:
    """Status and stderr of a command."""
    command = name.partition(" ")[0]
    monkeypatch.setattr(sys, "argv", [command, *words])
    status = 0
    try:
        import_module(f"tactile_cube.{command}").main()
    except SystemExit as end:
        status = int(end.code or 0)
    return status, capfd.readouterr().err


@pytest.mark.parametrize(
    ("name", "damage"), [*((name, "") for name in MAKING), *((name, "flipped") for name in COMMANDS)]
)
def test_a_command_that_takes_a_policy_runs_nothing_of_it(name, damage, monkeypatch, capfd) -> None:
    config = with_evil("a class below the hand's")
    policy(Path("evil.safetensors"), config, damage)
    policy(Path("run/policy_1.safetensors"), config, damage)
    status, said = typed(name, COMMANDS[name], monkeypatch, capfd)
    assert (status, said.count("\n"), said.startswith("error: ")) == (2, 1, True), said
    assert untouched()
    assert ("checksum" if damage else FOREIGN) in said


def test_loading_a_policy_in_a_program_runs_nothing_of_it() -> None:
    file = policy(Path("evil.safetensors"), with_evil("a class below the hand's"))
    tactile_cube.load_policy(file)
    with pytest.raises(InputError, match=FOREIGN):
        tactile_cube.export(file, "evil.npz")
    assert untouched()


class Harmful:
    """What a pickle runs when it is read by a reader that trusts it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (MARK,)


def checkpoint(state: Any) -> None:
    """What `torch.save` makes of a state, under a checksum that fits, in a run's folder."""
    stream = io.BytesIO()
    torch.save(state, stream)
    Path("next").mkdir()
    content = stream.getvalue()
    Path("next", FILE).write_bytes(HEAD + hashlib.sha256(content).hexdigest().encode() + b"\n" + content)


def state(**changes: Any) -> dict[str, Any]:
    replay = {"written": 0, "capacity": 5, "transitions": [torch.zeros(0, 3)], "generator": None}
    learner = {"agent": {"parameters": torch.zeros(3)}, "replay": replay | changes.pop("replay", {})}
    return {"learner": learner | changes, "best_angle": 0.0, "config": {}}


BAD_STATES = {
    "a pickle that runs something": ({"learner": Harmful()}, "damaged checkpoint"),
    "a list": ([1, 2], "damaged checkpoint"),
    "no learner": ({"learner": 3}, "damaged checkpoint"),
    "a replay that claims 1e15 rows": (state(replay={"written": 10**15, "capacity": 10**15}), f"claims {10**15} tran"),
    "a replay that is no list": (state(replay={"transitions": 3}), "damaged checkpoint"),
    "a number repeated 1e12 times": (state(agent={"a": torch.zeros(1).expand(10**12)}), "more than the file"),
    "weights that are no numbers": (state(agent={"a": [torch.tensor([torch.nan])]}), "not finite"),
}


@pytest.mark.parametrize(
    "words", [[], ["training.init_from=next", "hydra.run.dir=other"]], ids=["resumed", "begun with"]
)
@pytest.mark.parametrize("name", BAD_STATES)
def test_a_run_takes_nothing_from_a_bad_checkpoint(name, words, monkeypatch, capfd) -> None:
    bad, reason = BAD_STATES[name]
    checkpoint(bad)
    status, said = typed("train", ["+experiment=smoke", *RUN, *words], monkeypatch, capfd)
    assert (status, said.count("\n"), said.startswith("error: ")) == (2, 1, True), said
    assert untouched()
    assert words or reason in said
