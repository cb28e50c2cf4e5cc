"""Readers of untrusted files: a sound example of each kind, and the reader that a command uses."""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import polars
import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from safetensors.numpy import load

from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, load_actor, save_policy, sealed
from tactile_cube.api.job import as_input_errors
from tactile_cube.composition import composed
from tactile_cube.deployment.controller import read_network
from tactile_cube.deployment.export import interface_contract
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile, read_model, write_model
from tactile_cube.env import Task
from tactile_cube.evaluation.policies import HoldPolicy, PolicySource, environment
from tactile_cube.hand.dlr_hand2 import DLR_HAND2
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.rig import read_rig
from tactile_cube.measurement.recordings.writing import write_recordings
from tactile_cube.measurement.sources.source import recording_tables, source_settings
from tactile_cube.training.checkpoint import FILE, HEAD, Checkpoints, require_same_settings
from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings
from tactile_cube.transforms import EnvConfig
from tests.measurement.small_rig import URDF, table, write
from tests.measurement.sources.small_bag import write_bag

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][\w.]*")
VALUES = (
    *(b"nan", b".nan", b"inf", b"-.inf", b"1e308", b"-1e308", b"1e400", b"5e-324", b"0", b"-1", b"1e-12", b"123456"),
    *(b"99999999999999999999", b"9" * 5000, b"0x1F", b"1_000", b"1,5", b"2026-01-01", b"12:30:45", b"", b"''", b"~"),
    *(b"true", b"[]", b"{}", b"[1, 2]", b"{a: 1}", b"text", b"\xc3\xa9", b"\xff\xfe", b"\x00", b"../../etc/passwd"),
    *(b"&a [*a]", b"*b", b"!!python/name:os.system", b"[" * 3000, b"{a: " * 2000, b"${oc.env:HOME}", b"&lt;", b"%s"),
)
"""What may stand in the place of a number or a word."""


def damaged(content: bytes, random: Random) -> bytes:
    """The content with one to three damages."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = random.choice(DAMAGES)(content, random)
    return content


def _flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 8))):
        if changed:
            changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _span(content: bytes, random: Random) -> tuple[int, int]:
    first = random.randrange(len(content) + 1)
    return first, min(len(content), first + random.choice((1, 4, 50, len(content))))


def _delete(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:first] + content[end:]


def _repeat(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:end] + content[first:end] + content[end:]


def _blank(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:first] + random.choice((b"\x00", b"\xff")) * (end - first) + content[end:]


def _insert(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.randbytes(random.choice((1, 3, 40))) + content[at:]


def _replace(pattern: re.Pattern[bytes]) -> Callable[[bytes, Random], bytes]:
    def replace(content: bytes, random: Random) -> bytes:
        found = list(pattern.finditer(content[:100_000]))
        if not found:
            return content
        spot = random.choice(found)
        other = random.choice(found).group()
        return content[: spot.start()] + random.choice((*VALUES, other, other)) + content[spot.end() :]

    return replace


def _lines(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(4):
        case 0:
            del lines[one]
        case 1:
            lines.insert(other, lines[one])
        case 2:
            lines[one], lines[other] = lines[other], lines[one]
        case _:
            lines[one] = b"  " + lines[one]
    return b"\n".join(lines)


DAMAGES = (_flip, _delete, _repeat, _blank, _insert, _lines, *([_replace(NUMBER), _replace(WORD)] * 2))


GAINS = {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0}


def damage_a_file(folder: Path, random: Random) -> None:
    """Damage to one of the files of a folder, small ones as often as large ones."""
    path = random.choice(sorted(path for path in folder.rglob("*") if path.is_file()))
    path.write_bytes(damaged(path.read_bytes(), random))


@dataclass(frozen=True)
class Reader:
    """A kind of file.

    Attributes:
        name: in the table.
        share: of the inputs of a campaign, relative to the others'.
        make: writes a sound example into an empty folder.
        read: what a command does with it; may write into the sub-folder "out".
        damage: does something to the example.
    """

    name: str
    share: int
    make: Callable[[Path], object]
    read: Callable[[Path], object]
    damage: Callable[[Path, Random], None] = damage_a_file


def _csv_recording(folder: Path) -> None:
    write(folder, lambda data: data.update(trials=[{"file": "first.csv"}, {"file": "second.npz"}]))
    polars.read_parquet(folder / "first.parquet").write_csv(folder / "first.csv")
    columns = polars.read_parquet(folder / "second.parquet")
    import numpy as np

    np.savez(folder / "second.npz", **{name: columns[name].to_numpy() for name in columns.columns})  # type: ignore[arg-type]
    (folder / "first.parquet").unlink()
    (folder / "second.parquet").unlink()


def _csv(folder: Path) -> None:
    (folder / "rig.urdf").write_text(URDF)
    names = {"time": "t", "a.command": "a_cmd", "a.position": "a", "b.command": "b_cmd", "b.position": "b"}
    for number in (1, 2):
        polars.DataFrame({names[own]: values for own, values in table(number).items() if own in names}).write_csv(
            folder / f"log{number}.csv"
        )


def _import_csv(folder: Path) -> None:
    logs = [str(folder / "log1.csv"), str(folder / "log2.csv")]
    _import(folder, "csv", files=logs)


def _import(folder: Path, option: str, **said: object) -> None:
    settings = source_settings(option, {"urdf": str(folder / "rig.urdf"), "controller": GAINS, **said})
    write_recordings(folder / "out", recording_tables(settings, option, 0))


def _bag(folder: Path) -> None:
    (folder / "rig.urdf").write_text(URDF)
    write_bag(folder / "bag.mcap")


def _import_bag(folder: Path) -> None:
    _import(folder, "mcap", files=[str(folder / "bag.mcap")], joints=["a", "b"])


MJCF = """<mujoco><compiler angle="radian"/><default><default class="c"><joint armature="0.02"/></default></default>
<worldbody><body name="a" euler="0 0.1 0"><joint name="j" class="c" axis="0 1 0" ref="0.1" range="-1 1"/>
<geom type="capsule" size="0.02 0.1"/><body pos="0 0 0.3"><joint name="k" type="slide" frictionloss="0.2"/>
<inertial pos="0 0 1" mass="2" diaginertia="1 1 1"/></body></body></worldbody>
<equality><joint joint1="k" joint2="j" polycoef="0 1 0 0 0"/></equality>
<actuator><position joint="j" kp="5" kv="0.3" gear="2"/></actuator></mujoco>"""


def _read_mjcf(folder: Path) -> None:
    RigidBodyTree.from_urdf(read_rig(folder / "rig.xml").text)


def _read_urdf(folder: Path) -> None:
    RigidBodyTree.from_urdf(read_rig(folder / "rig.urdf").text)


def model() -> ModelFile:
    """Return a model of a finger, with an effect of the drivetrain and one of the object."""
    interval = Estimate(value=0.24, low=0.23, high=0.25, unit="N m s/rad")
    play = Estimate(value=1e-3, low=5e-4, high=2e-3, unit="rad")
    return ModelFile(
        rig="rig.urdf",
        joints=["q1", "q2", "q3"],
        values={"kd": dict.fromkeys(("q1", "q2", "q3"), interval)},
        effects=[
            EffectEstimate(effect="backlash@q2", parameters={"play": play}),
            EffectEstimate(effect="object_mass", parameters={"excess": Estimate(value=0.01, low=0.0, high=0.02)}),
        ],
        offsets={"q1": Estimate(value=0.0, low=-0.02, high=0.02, unit="rad")},
    )


def _read_model(folder: Path) -> None:
    EnvConfig(Task("full"), model=read_model(folder / "model.yaml"))


@cache
def _evaluation() -> DictConfig:
    return composed("evaluate", [])


def _policy(folder: Path) -> None:
    torch.manual_seed(0)
    actor = Actor(Sizes(120, 0, 12), (8,))
    config: Any = OmegaConf.to_container(composed("train", ["+experiment=smoke"]), resolve=True)
    info = PolicyInfo.describe(actor, config={"env": config["env"]})
    save_policy(folder / "policy.safetensors", actor, info)
    (folder / "info.json").write_text(info.model_dump_json())


def _damage_policy(folder: Path, random: Random) -> None:
    """To the file, which the checksum shows, or to its contents under a checksum that fits."""
    path, info = folder / "policy.safetensors", folder / "info.json"
    content, text = path.read_bytes(), info.read_bytes()
    info.unlink()
    if random.random() < 0.3:
        path.write_bytes(damaged(content, random))
        return
    try:
        path.write_bytes(sealed(load(content), damaged(text, random).decode()))
    except UnicodeDecodeError:
        path.write_bytes(damaged(content, random))


def _read_policy(folder: Path) -> None:
    (folder / "info.json").unlink(missing_ok=True)
    info = load_actor(folder / "policy.safetensors")[1]
    environment(_evaluation(), PolicySource(HoldPolicy(), "stranger", config=info.config), {})
    interface_contract(read_network(folder / "policy.safetensors"))


def state(written: int, capacity: int, seed: int) -> dict[str, Any]:
    """What a run saves, with a ring of `capacity` rows of two numbers after `written` of them."""
    random = torch.Generator().manual_seed(seed)
    rows = torch.arange(2 * written, dtype=torch.float32).reshape(written, 2)
    ring = torch.empty(min(written, capacity), 2)
    ring[torch.arange(written)[-capacity:] % capacity] = rows[-capacity:]
    replay = {"transitions": [ring], "written": written, "capacity": capacity, "generator": random.get_state()}
    agent = {"parameters": [torch.randn(3, generator=random)], "updates": written}
    return {"learner": {"agent": agent, "replay": replay}, "best_angle": 0.5, "config": {"seed": seed}}


def _checkpoint(folder: Path) -> None:
    checkpoints = Checkpoints(folder)
    for written in (6, 11):
        checkpoints.save(state(written, 8, 0))


def _damage_checkpoint(folder: Path, random: Random) -> None:
    """To a file, which the checksum shows, or to its contents under a checksum that fits."""
    if random.random() < 0.5:
        damage_a_file(folder, random)
        return
    content = damaged((folder / FILE).read_bytes()[len(HEAD) + 65 :], random)
    (folder / FILE).write_bytes(HEAD + hashlib.sha256(content).hexdigest().encode() + b"\n" + content)


def _read_checkpoint(folder: Path) -> None:
    saved = Checkpoints(folder).load()
    if saved is not None:
        require_same_settings(folder / FILE, saved["config"], {"seed": 0})


@cache
def _keys() -> tuple[str, ...]:
    def keys(part: Any, prefix: str) -> list[str]:
        if not isinstance(part, dict):
            return [prefix]
        inner = [key for name, value in part.items() for key in keys(value, f"{prefix}.{name}".strip("."))]
        return [prefix, *inner] if prefix else inner

    return tuple(keys(OmegaConf.to_container(composed("train", ["+experiment=smoke"])), ""))


def _settings(folder: Path) -> None:
    (folder / "words.json").write_text(json.dumps(["+experiment=smoke"]))


def _damage_settings(folder: Path, random: Random) -> None:
    values = [value.decode(errors="replace") for value in VALUES if len(value) < 100]
    words = [f"{random.choice(_keys())}={random.choice(values)}" for _ in range(random.choice((1, 1, 2)))]
    (folder / "words.json").write_text(json.dumps(["+experiment=smoke", *words]))


@as_input_errors
def _compose(folder: Path) -> None:
    config: Any = composed("train", json.loads((folder / "words.json").read_text()))
    plain: Any = OmegaConf.to_container(config, resolve=True)
    RunSettings(name=config.name, seed=config.seed)
    CollectorSettings(**plain["collector"])
    TrainingSettings(**plain["training"])
    instantiate(config.agent, _partial_=True)
    instantiate(config.env)


READERS = (
    Reader("recording (YAML, URDF, Parquet)", 20, write, read_recording),
    Reader("recording (CSV, NPZ)", 15, _csv_recording, read_recording),
    Reader("import of CSV", 15, _csv, _import_csv),
    Reader("import of a ROS 2 bag (MCAP)", 8, _bag, _import_bag),
    Reader("URDF of two joints", 10, lambda folder: (folder / "rig.urdf").write_text(URDF), _read_urdf),
    Reader(
        "URDF of a finger", 8, lambda folder: (folder / "rig.urdf").write_text(DLR_HAND2.finger_urdf(0)), _read_urdf
    ),
    Reader("MJCF", 8, lambda folder: (folder / "rig.xml").write_text(MJCF), _read_mjcf),
    Reader("model file", 12, lambda folder: write_model(model(), folder / "model.yaml"), _read_model),
    Reader("policy", 8, _policy, _read_policy, _damage_policy),
    Reader("checkpoint", 10, _checkpoint, _read_checkpoint, _damage_checkpoint),
    Reader("settings on the command line", 2, _settings, _compose, _damage_settings),
)
