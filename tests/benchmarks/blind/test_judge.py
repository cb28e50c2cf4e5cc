"""The blind world against a second engine, its recordings, the rules of the judge, quick draws with real commands."""

import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
import yaml

from benchmarks.blind import generator, hidden, judge
from benchmarks.blind.dynamics import mass_and_bias
from benchmarks.blind.physics import simulate
from benchmarks.blind.plant import neutral
from benchmarks.blind.rig import RIGS
from benchmarks.blind.scoring import pushes_found, score

QUICK = 3.0


@pytest.mark.parametrize("kind", sorted(RIGS))
def test_dynamics_equal_those_of_mujoco(kind: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    rig = RIGS[kind](np.random.default_rng(3))
    header = '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco><link name="base"/>'
    model = mujoco.MjModel.from_xml_string(rig.urdf().replace('<link name="base"/>', header))
    model.opt.gravity[:] = rig.gravity
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (np.random.default_rng(i).normal(size=len(rig.links)) for i in (1, 2))
    mujoco.mj_forward(model, data)
    bias = mass_and_bias(*rig.arrays(), np.array(rig.gravity), data.qpos.copy(), data.qvel.copy())[1]
    np.testing.assert_allclose(bias, data.qfrc_bias, rtol=1e-6, atol=1e-9)


def test_a_joint_sticks_without_creeping_and_slips_at_its_friction() -> None:
    rig = RIGS["pendulum"](np.random.default_rng(0))
    rig.gravity = (0.0, 0.0, 0.0)
    values = {"kp": 5.0, "kd": 0.3, "torque_limit": 1.0, "stiffness": 50.0}
    values |= {"static_friction": 0.05, "reflected_inertia": 0.004}
    plant = neutral(1)._replace(**{name: np.array([value]) for name, value in values.items()})
    start = np.zeros(1)
    held = simulate(rig, plant, np.full((1000, 1), 0.009), 500.0, start)[2]
    moved = simulate(rig, plant, np.full((1000, 1), 0.03), 500.0, start)[2]
    assert np.abs(held).max() < 1e-12
    assert moved[-1, 0] > 0.005


def test_a_recommended_command_is_played_on_the_rig_that_was_measured(tmp_path: Path) -> None:
    truth = generator.write(7, tmp_path, seconds=QUICK)
    description = tmp_path / "recording" / "recording.yaml"
    last = yaml.safe_load(description.read_text())["trials"][-1]
    measured = pl.read_parquet(tmp_path / "recording" / last["file"])
    measured.write_csv(tmp_path / "next_experiment.csv")
    generator.play(tmp_path, tmp_path / "next_experiment.csv", seconds=QUICK)
    added = yaml.safe_load(description.read_text())["trials"][-1]
    assert added["initialisation"] == last["initialisation"]
    again = pl.read_parquet(tmp_path / "recording" / added["file"])
    joints = [name for name in measured.columns if name.endswith(".position")]
    common = measured.select("time", *joints).join(again.select("time", *joints), on="time", suffix="_again")
    different = np.stack([(common[name] - common[f"{name}_again"]).to_numpy() for name in joints])
    assert len(common) > 0.8 * len(measured)
    assert 0.0 < np.median(np.abs(different)) < 3.0 * truth["sensor_floor"], "a log of its own of the same machine"


@pytest.mark.parametrize(("kind", "name"), [("finger", "torque_crosstalk"), ("pendulum", "stribeck_friction")])
def test_both_engines_measure_the_same(kind: str, name: str) -> None:
    pytest.importorskip("mujoco")
    from benchmarks.blind import mujoco_physics

    world = generator.draw(1, QUICK, [name], kind)[0]
    command = np.linspace(world.low, world.high, 200)
    held = np.tile(command[:1], (200, 1))
    own, still = (simulate(world.rig, world.plant, c, 500.0, command[0])[0] for c in (command, held))
    other = mujoco_physics.simulate(world.rig, world.plant, command, 500.0, command[0], step=1e-4)[0]
    assert np.abs(own - other).max() < 1e-3 < 0.1 < np.abs(own - still).max()


@pytest.mark.parametrize("name", ["stribeck_friction", "command_delay", "backlash", "cogging", "joint_stop"])
def test_a_hidden_effect_moves_the_joint_beyond_the_noise(name: str) -> None:
    assert generator.draw(1, QUICK, [name], "pendulum")[2]["visible"]


def test_every_catalogue_name_is_drawn_within_sixty_seeds() -> None:
    rng = np.random.default_rng(0)
    drawn = {name for seed in range(10_000, 10_060) for name in generator.names_for(seed, rng)[1]}
    assert set(hidden.NAMED) | set(hidden.UNNAMED) <= drawn


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("draw")
    generator.write(2, out, QUICK, ["command_delay"], "pendulum")
    return out


def test_a_recording_repeats_each_command_and_tells_nothing_of_the_truth(folder: Path) -> None:
    described = yaml.safe_load((folder / "recording" / "recording.yaml").read_text())
    joint = described["joints"][0]
    tables = {
        trial["file"]: pl.read_parquet(folder / "recording" / trial["file"])
        for trial in described["trials"]
        if trial["kind"] == described["trials"][0]["kind"]
    }
    commands = [t[f"{joint}.command"].to_list()[:100] for t in tables.values()]
    assert len(commands) > 1
    assert all(c == commands[0] for c in commands)
    texts = [p.read_text() for p in (folder / "recording").rglob("*") if p.suffix in (".yaml", ".urdf", ".json")]
    assert not any("delay" in text for text in texts)


def test_the_same_seed_writes_the_same_recording(folder: Path, tmp_path: Path) -> None:
    generator.write(2, tmp_path, QUICK, ["command_delay"], "pendulum")
    files = sorted(p.relative_to(folder) for p in folder.rglob("*.parquet"))
    assert files
    assert all(pl.read_parquet(folder / f).equals(pl.read_parquet(tmp_path / f)) for f in files)


def test_a_push_moves_its_trial_while_it_lasts_and_no_other(folder: Path, tmp_path: Path) -> None:
    (push,) = generator.write(2, tmp_path, QUICK, ["command_delay"], "pendulum", pushes=1)["pushes"]
    moved = {}
    for file in sorted(p.relative_to(folder) for p in folder.rglob("*.parquet")):
        left, other = (pl.read_parquet(one / file) for one in (folder, tmp_path))
        column = f"{push['joint']}.position"
        moved[file.stem, file.parent.name] = (left["time"], (left[column] - other[column]).abs())
    time, change = moved.pop((push["trial"], "trials"))
    assert change.filter(time < push["start"] - 0.01).max() < 1e-9  # type: ignore[operator]
    assert change.filter((time > push["start"]) & (time < push["start"] + push["seconds"])).max() > 0.01  # type: ignore[operator]
    assert all(others.max() < 1e-9 for _, others in moved.values())  # type: ignore[operator]


def test_a_push_is_found_where_a_stretch_of_its_trial_was_left_out() -> None:
    pushes = [{"trial": "holds_0", "start": 1.0, "seconds": 0.5}, {"trial": "ramps_1", "start": 2.0, "seconds": 0.5}]
    stretches = [("holds_0", 0.8, 1.6), ("holds_0", 3.0, 3.5), ("ramps_1", 2.6, 3.0)]
    left_out = [{"trial": trial, "start": start, "end": end} for trial, start, end in stretches]
    assert pushes_found(pushes, {"left_out": left_out}) == (2, 1, 2)
    assert pushes_found([], {}) == (0, 0, 0)


def test_a_world_that_runs_away_is_drawn_again(tmp_path: Path) -> None:
    truth = generator.write(90003, tmp_path)  # negative damping in its first world
    assert truth["effects"][0]["name"] == "position_velocity_product"
    tables = [pl.read_parquet(file).to_numpy() for file in tmp_path.rglob("*.parquet")]
    assert tables
    assert all(np.isfinite(table).all() for table in tables)


def _truth(*effects: tuple[str, str], catalogue: bool = True) -> dict[str, Any]:
    keys = {"any_joint": False, "in_catalogue": catalogue, "distinct": 5.0, "signal": 5.0}
    made = [{"name": n, "joints": [j], "absorbed": n in hidden.ABSORBED, **keys} for n, j in effects]
    return {"effects": made, "rig": "finger", "repeat_scatter": 3e-4, "sensor_floor": 3e-4}


def _form(*family: str, beside: tuple[str, ...] = ()) -> dict[str, Any]:
    truth = _truth(("a form", "q1"))
    truth["effects"][0] |= {"names": list(family), "beside": list(beside)}
    return truth


def _answer(verdict: str, *effects: tuple[str, str], rivals: tuple[str, ...] = ()) -> dict[str, Any]:
    return {"verdict": verdict, "effects": [{"name": n, "joints": [j], "rivals": list(rivals)} for n, j in effects]}


def _twin() -> dict[str, Any]:
    truth = _truth(TILT)
    truth["effects"][0] |= {"any_joint": True, "twins": ["position_offset"]}
    return truth


PLAY, COGS, RUB = ("backlash", "q1"), ("cogging", "q2"), ("coulomb_friction", "q1")
ZERO, TILT = ("position_offset", "q1"), ("mount_tilt", "q1")


@pytest.mark.parametrize(
    ("truth", "answer", "ratio", "outcome"),
    [
        (_truth(), _answer("adequate"), 3.0, "right"),
        (_truth(), _answer("missing_effect", PLAY), 1.0, "wrong"),
        (_truth(), _answer("unknown_effect"), 1.0, "wrong"),
        (_truth(PLAY), _answer("missing_effect", PLAY), 2.0, "right"),
        (_truth(PLAY), _answer("missing_effect", ("backlash", "q2")), 1.0, "wrong"),
        (_truth(PLAY), _answer("missing_effect", PLAY, COGS), 1.0, "wrong"),
        (_truth(PLAY), _answer("missing_effect", COGS, rivals=("backlash@q1",)), 1.0, "wrong"),
        (_truth(PLAY), _answer("ambiguous", ("cogging", "q1"), rivals=("backlash",)), 2.0, "acceptable"),
        (_truth(PLAY), _answer("ambiguous", COGS, rivals=("backlash@q1",)), 2.0, "acceptable"),
        (_truth(PLAY), _answer("ambiguous", COGS, rivals=("backlash",)), 1.0, "wrong"),
        (_truth(PLAY), _answer("adequate"), 1.05, "acceptable"),
        (_truth(PLAY), _answer("adequate"), 1.5, "wrong"),
        (_truth(PLAY), _answer("unknown_effect"), 1.0, "wrong"),
        (_truth(PLAY), _answer("partly_explained", PLAY), 3.0, "acceptable"),
        (_truth(PLAY), _answer("partly_explained", COGS), 3.0, "wrong"),
        (_truth(RUB), _answer("adequate"), 1.0, "acceptable"),
        (_truth(PLAY, COGS), _answer("missing_effect", COGS, PLAY), 1.0, "right"),
        (_truth(PLAY, COGS), _answer("missing_effect", COGS), 1.5, "wrong"),
        (_form("backlash"), _answer("missing_effect", PLAY), 2.0, "right"),
        (_form("cogging", "backlash"), _answer("missing_effect", PLAY, ("cogging", "q1")), 2.0, "right"),
        (_form("backlash"), _answer("missing_effect", PLAY, COGS), 2.0, "wrong"),
        (_form("backlash"), _answer("partly_explained", PLAY), 2.0, "acceptable"),
        (_form("backlash"), _answer("ambiguous", RUB, rivals=("backlash",)), 2.0, "acceptable"),
        (_form("backlash"), _answer("unknown_effect"), 2.0, "wrong"),
        (_form("backlash", beside=("coulomb_friction",)), _answer("missing_effect", PLAY, RUB), 2.0, "right"),
        (_form("backlash", beside=("coulomb_friction",)), _answer("missing_effect", RUB), 2.0, "wrong"),
        (_truth(ZERO), _answer("adequate") | {"common_offsets": [{"joint": "q1"}]}, 9.0, "acceptable"),
        (_truth(ZERO), _answer("adequate") | {"common_offsets": [{"joint": "q2"}]}, 9.0, "wrong"),
        (_truth(RUB), _answer("adequate") | {"common_offsets": [{"joint": "q1"}]}, 9.0, "wrong"),
        (_twin(), _answer("ambiguous", TILT, rivals=("position_offset@q1",)), 1.0, "right"),
        (_twin(), _answer("ambiguous", ZERO, rivals=("mount_tilt",)), 1.0, "right"),
        (_twin(), _answer("ambiguous", TILT, rivals=("payload",)), 1.0, "acceptable"),
        (_twin(), _answer("missing_effect", TILT), 1.0, "acceptable"),
        (_twin(), _answer("missing_effect", ZERO), 1.0, "wrong"),
        (_truth(PLAY, catalogue=False), _answer("unknown_effect"), 3.0, "right"),
        (_truth(PLAY, catalogue=False), _answer("ambiguous", COGS), 3.0, "acceptable"),
        (_truth(PLAY, catalogue=False), _answer("missing_effect", COGS), 1.0, "wrong"),
    ],
)
def test_the_judge(truth: dict[str, Any], answer: dict[str, Any], ratio: float, outcome: str) -> None:
    assert score(truth, answer, ratio).outcome == outcome


@pytest.mark.parametrize(
    ("answer", "ratio", "confident"),
    [
        (_answer("adequate"), 1.5, True),
        (_answer("adequate"), 1.05, False),
        (_answer("missing_effect", COGS), 1.0, True),
        (_answer("unknown_effect"), 1.5, False),
        (_answer("partly_explained", COGS), 1.5, False),
        (_answer("ambiguous", COGS), 1.5, False),
    ],
)
def test_an_answer_after_which_nobody_looks_further_is_confidently_wrong(answer, ratio, confident) -> None:
    assert score(_truth(PLAY), answer, ratio).confident == confident


def test_the_summary_counts_what_was_drawn_again_and_the_row_names_commit_and_seeds() -> None:
    truth = {**_truth(PLAY), "seed": 7, "drawn": 2, "visible": False}
    line = {
        "seed": 7,
        "truth": truth,
        "diagnosis": _answer("ambiguous", PLAY, rivals=("cogging",)),
        "wall_seconds": 1.0,
    }
    summary = judge.summarise([judge.judged({**line, "commit": "abc"})])
    assert (summary["drawn_again"], summary["below_visible"], summary["ambiguous_set_sizes"]) == (1, 1, [2])
    row = judge.round_row(summary, "python -m benchmarks.blind.judge --draws 1 --first-seed 7")
    assert row == "| 7, 1 | `abc` | 0, 1, 0 (0) | 0 of 0 | ... |"
    pushed = judge.judged({**line, "truth": truth | {"pushes": [{"trial": "t", "start": 1.0, "seconds": 1.0}]}})
    assert judge.summarise([pushed])["pushes"] == [1, 0, 0]


def test_the_judge_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[int] = []

    def commands(name: str, out: Path, *words: str) -> dict[str, Any]:
        out.mkdir(parents=True)
        (out / "model.yaml").write_text("")
        return {**_answer("adequate"), "error": {"overall": 3e-4}}

    def written(seed: int, out: Path, seconds: float | None, **_: object) -> dict[str, Any]:
        judged.append(seed)
        (out / "recording").mkdir(parents=True)
        return {"seed": seed, **_truth()}

    monkeypatch.setattr(judge, "run_command", commands)
    monkeypatch.setattr(judge, "write", written)
    monkeypatch.setattr(judge, "each", lambda work, over, jobs: ((one, work(one)) for one in over))
    for draws in (2, 3):
        monkeypatch.setattr(sys, "argv", ["judge.py", "--draws", str(draws), "--out", str(tmp_path)])
        judge.main()
    assert judged == [10_000, 10_001, 10_002]
    summary = json.loads((tmp_path / "identification.json").read_text())
    assert summary["false_alarms"] == [0, 3]
    assert summary["right"] == 3


@pytest.mark.skipif(importlib.util.find_spec("tactile_cube.diagnose") is None, reason="no diagnose command")
@pytest.mark.parametrize(("seed", "names"), [(3, []), (4, ["command_delay"])])
def test_diagnosis_of_a_short_recording(seed: int, names: list[str], tmp_path: Path) -> None:
    generator.write(seed, tmp_path, 0.5 * QUICK, names, "pendulum")
    truth = json.loads((tmp_path / "truth.json").read_text())
    answer = judge.run_command("diagnose", tmp_path / "answer", f"recording={tmp_path / 'recording'}", "report=false")
    assert answer is not None, (tmp_path / "answer" / "words.txt").read_text()
    assert score(truth, answer, None).outcome in ("right", "acceptable"), answer["verdict"]
