"""Whatever is written is read back; whatever is damaged is read or refused in one line."""

import tempfile
from base64 import b85encode
from pathlib import Path
from random import Random

import numpy as np
import polars
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

import tactile_cube
from benchmarks.faults.fuzz import strike
from benchmarks.faults.readers import GAINS, READERS, Reader, state
from tactile_cube.agent.networks import Actor, Sizes
from tactile_cube.agent.policy_file import PolicyInfo, load_actor, save_policy
from tactile_cube.api.job import as_input_errors
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile, read_model, write_model
from tactile_cube.errors import InputError
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording, write_recordings
from tactile_cube.measurement.sources.source import described, recording_tables, source_settings
from tactile_cube.training.checkpoint import Checkpoints
from tactile_cube.training.settings import TrainingSettings
from tests.measurement.small_rig import URDF, Table, table, write

few = settings(derandomize=True, max_examples=15, deadline=None, database=None)
sizes = st.floats(1e-6, 1e3)
names = st.text("abcdefgh_:-é ", min_size=1, max_size=12)


@pytest.fixture(scope="module", params=READERS[:-1], ids=lambda reader: reader.name)
def example(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Reader, Path]:
    sound = tmp_path_factory.mktemp("sound")
    request.param.make(sound)
    return request.param, sound


@few
@given(seed=st.integers(0, 2**32))
def test_damaged_files_are_read_or_refused_in_one_line(example: tuple[Reader, Path], seed: int) -> None:
    reader, sound = example
    with tempfile.TemporaryDirectory() as place:
        outcome = strike(reader, sound, Path(place) / "damaged", Random(seed))
    assert outcome.kind in ("read", "refused"), outcome


@few
@given(low=sizes, width=sizes, name=names, joints=st.lists(names, min_size=1, max_size=4, unique=True))
def test_any_model_is_read_back_as_it_was_written(low: float, width: float, name: str, joints: list[str]) -> None:
    value = Estimate(value=low + width / 2, low=low, high=low + width, unit="N m")
    effects = [EffectEstimate(effect=f"backlash@{joints[0]}", parameters={"play": value})]
    model = ModelFile(rig=name, joints=joints, values={"kp": dict.fromkeys(joints, value)}, effects=effects)
    with tempfile.TemporaryDirectory() as place:
        write_model(model, Path(place) / "model.yaml")
        assert read_model(Path(place) / "model.yaml") == model


@few
@given(width=st.integers(1, 40), action=st.integers(1, 6), hidden=st.lists(st.integers(1, 20), min_size=1, max_size=3))
def test_any_policy_is_read_back_bit_for_bit(width: int, action: int, hidden: list[int]) -> None:
    actor = Actor(Sizes(width, 0, action), tuple(hidden))
    with tempfile.TemporaryDirectory() as place:
        save_policy(Path(place) / "policy.safetensors", actor, PolicyInfo.describe(actor, seed=3, config={"a": width}))
        back, info = load_actor(Path(place) / "policy.safetensors")
    assert (info.observation_size, info.action_size, info.hidden) == (width, action, tuple(hidden))
    assert all(torch.equal(a, b) for a, b in zip(actor.parameters(), back.parameters(), strict=True))


@few
@given(capacity=st.integers(1, 12), arrivals=st.lists(st.integers(0, 15), min_size=1, max_size=5))
def test_the_newest_checkpoint_is_read_back_however_rows_arrived(capacity: int, arrivals: list[int]) -> None:
    written = list(np.cumsum([1, *arrivals]))
    with tempfile.TemporaryDirectory() as place:
        checkpoints = Checkpoints(Path(place))
        for count in written:
            checkpoints.save(state(int(count), capacity, 1))
        loaded = Checkpoints(Path(place)).load()
    assert loaded is not None
    expected = state(int(written[-1]), capacity, 1)
    assert torch.equal(*(one["learner"]["replay"]["transitions"][0] for one in (loaded, expected)))
    assert torch.equal(loaded["learner"]["agent"]["parameters"][0], expected["learner"]["agent"]["parameters"][0])


@few
@given(noise=st.floats(0, 1e-3), offset=st.floats(-0.02, 0.02), begin=st.floats(-100, 1e6))
def test_any_motion_comes_back_from_a_recording(noise: float, offset: float, begin: float) -> None:
    columns = table(3, noise=noise, offset=offset)

    def put(first: Table) -> None:
        first.update(columns | {"time": columns["time"] + begin})

    with tempfile.TemporaryDirectory() as place:
        trial = read_recording(write(Path(place), spoil=put)).trials[0]
    assert np.allclose(trial.position[:, 0], columns["a.position"], atol=1e-9)
    assert trial.time[0] == 0.0


@few
@given(tick=st.sampled_from([1.0, 1e3, 1e6]), degrees=st.booleans(), seed=st.integers(0, 1000))
def test_an_imported_log_is_the_motion_that_was_logged(tick: float, degrees: bool, seed: int) -> None:
    columns, angle = table(seed), 180 / np.pi if degrees else 1.0
    log = {f"{j}_{s}": columns[f"{j}.{s}"] * angle for j in "ab" for s in ("command", "position")}
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        (place / "rig.urdf").write_text(URDF)
        polars.DataFrame({"time": columns["time"] * tick} | log).write_csv(place / "log.csv")
        said = {"files": [str(place / "log.csv")], "urdf": str(place / "rig.urdf"), "controller": GAINS}
        write_recordings(place / "out", recording_tables(source_settings("csv", said), "csv", 0))
        trial = read_recording(place / "out").trials[0]
    assert np.allclose(trial.position[:, 1], columns["b.position"], atol=1e-6)


@few
@given(masses=st.lists(sizes, min_size=1, max_size=5), length=sizes)
def test_any_chain_of_links_is_read_with_its_masses(masses: list[float], length: float) -> None:
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    links = [
        f'<link name="l{k}"><inertial><mass value="{m!r}"/>{inertia}</inertial></link>' for k, m in enumerate(masses)
    ]
    joints = [
        f'<joint name="j{k}" type="continuous"><parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
        f'<origin xyz="{length!r} 0 0"/><axis xyz="0 0 1"/></joint>'
        for k in range(len(masses))
    ]
    tree = RigidBodyTree.from_urdf(f'<robot name="r"><link name="base"/>{"".join(links + joints)}</robot>')
    assert np.allclose(tree.mass, masses)
    assert tree.joint_names == tuple(f"j{k}" for k in range(len(masses)))


SECRET = b85encode(Random(1).randbytes(200)).decode()
"""What stands in a file outside of the recording.

Compression hides letters that stand elsewhere too, as four digits of a number may; four of 85 letters do not.
"""


def evil_recording(folder: Path) -> Path:
    """A short recording whose URDF names a file outside of its folder in every way, and one mesh of its own."""
    own, outside = folder / "evil", folder / "outside" / "secret.stl"
    outside.parent.mkdir()
    outside.write_text(SECRET)
    write(own, lambda data: data["trials"].append({"file": "first.parquet", "initialisation": 1, "kind": "sines"}))
    for file in own.glob("*.parquet"):
        polars.read_parquet(file)[:120].write_parquet(file)
    (own / "own.stl").write_text(SECRET[::-1])
    (own / "link.stl").symlink_to(outside)
    (own / "linked").symlink_to(outside.parent)
    names = [str(outside), f"file://{outside}", "../outside/secret.stl", "link.stl", "linked/secret.stl", "own.stl",
             "package://../outside/secret.stl", "package://x/../../outside/secret.stl", "/dev/zero"]  # fmt: skip
    meshes = [f'<mesh filename="{name}"/>' for name in names]
    meshes += [
        f"<mesh><filename>{outside}</filename></mesh>",
        f'<e:mesh xmlns:e="evil" e:filename="{outside}"/>',
        f'<mesh xmlns="evil" filename="{outside}"/>',
    ]
    shapes = "".join(
        f'<{kind}><geometry>{mesh}</geometry><material name="m"><texture filename="{outside}"/></material></{kind}>'
        if kind == "visual" and mesh != meshes[5] else f"<{kind}><geometry>{mesh}</geometry></{kind}>"
        for mesh in meshes for kind in ("visual", "collision")
    )  # fmt: skip
    material = f'<material name="m"><texture filename="{outside}"/></material>'
    urdf = URDF.replace('<link name="base"/>', f'{material}<link name="base">{shapes}</link>')
    (own / "rig.urdf").write_text(f'<!DOCTYPE robot [<!ENTITY f "{outside}">]>{urdf}')
    return own


def test_no_command_puts_what_lies_outside_of_a_recording_into_its_files(tmp_path: Path) -> None:
    evil, settings = evil_recording(tmp_path), {"say": lambda line: None}
    model = tmp_path / "identify" / "model.yaml"
    tactile_cube.compare(evil, values={"band.simulations": 0}, **settings).write(tmp_path / "compare")
    tactile_cube.identify(evil, ["torque_bias@b"], **settings).write(model.parent)
    tactile_cube.monitor(evil, model, **settings).write(tmp_path / "monitor")
    nothing_missing = {"criteria.floor": 1e8, "criteria.adequate": 1e9}
    tactile_cube.diagnose(evil, values=nothing_missing, **settings).write(tmp_path / "diagnose")
    polars.read_parquet(evil / "first.parquet").write_csv(tmp_path / "log.csv")
    said = {"files": [str(tmp_path / "log.csv")], "urdf": str(evil / "rig.urdf"), "controller": GAINS}
    write_recordings(tmp_path / "record", recording_tables(source_settings("csv", said), "csv", 0))
    for command in ("compare", "identify", "monitor", "diagnose", "record"):
        written = [file for file in (tmp_path / command).rglob("*") if file.is_file()]
        assert written
        for file in written:
            assert SECRET[:40].encode() not in file.read_bytes(), file
    assert SECRET[::-1][:40].encode() in (tmp_path / "compare" / "comparison.rrd").read_bytes()  # its own mesh is drawn
    assert any("are not drawn" in line for line in read_recording(evil).warnings)


@pytest.mark.parametrize("command", ["compare", "diagnose", "monitor", "evaluate", "train"])
def test_no_command_imports_what_a_model_names(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "stranger.py").write_text("raise SystemExit('imported')")
    model = ModelFile(joints=["a", "b"], effects=[EffectEstimate(effect="stranger.Drag@a")], errors={"over_noise": 1.0})
    write_model(model, tmp_path / "model.yaml")
    first = {"evaluate": ["hold"], "train": []}.get(command, [str(write(tmp_path / "r"))])
    with pytest.raises(InputError, match="stranger"):
        getattr(tactile_cube, command)(*first, model=tmp_path / "model.yaml")


def test_an_imported_log_names_no_file_outside_of_the_recording(tmp_path: Path) -> None:
    made = RecordingTables(described(gravity=[0, 0, -9.81], rate_hz=100, joints=["a"], controller=GAINS), URDF, [
        TrialTable(TrialEntry(file="trials/../../owned.parquet"), *(np.zeros((30, 1)),) * 3)
    ])  # fmt: skip
    with pytest.raises(InputError, match="lies outside of"):
        write_recording(tmp_path / "made", made)
    assert list(tmp_path.iterdir()) == []


@few
@given(value=st.one_of(st.floats(), st.integers(), st.text(max_size=20), st.booleans(), st.none()))
def test_a_setting_of_any_value_is_taken_or_refused(value: object) -> None:
    message, taken = "", None
    try:
        taken = as_input_errors(TrainingSettings)(updates_per_iteration=value)
    except InputError as error:
        message = str(error)
    assert "\n" not in message
    assert message or (taken is not None and taken.updates_per_iteration >= 0)
