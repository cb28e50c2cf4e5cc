"""A few faults, on a run as short as it gets; `python -m benchmarks.faults.campaign` strikes with all kinds."""

import ast
import random
import shutil
from pathlib import Path

import pytest

import tactile_cube.agent
import tactile_cube.training
from benchmarks.faults.campaign import KINDS, SHORT, damaged_checkpoints, results, same, strike, undisturbed


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """The folder of a run without a fault, and how long it took [s]."""
    run = tmp_path_factory.mktemp("runs") / "undisturbed"
    return run, undisturbed(run, SHORT)[1]


@pytest.mark.timeout(900)
def test_killed_processes_cost_nothing_and_leave_nothing(sound: tuple[Path, float], tmp_path: Path) -> None:
    run, seconds = sound
    moments = random.Random(0)
    for kind in KINDS[:2]:
        moment = moments.uniform(0.3, 0.9) * seconds
        outcome = strike(kind, tmp_path / kind.name.replace(":", ""), moment, SHORT, results(run))
        assert (outcome.orphans, outcome.damaged, outcome.equal) == (0, 0, True), outcome
        assert outcome.status is not None, "it hung"


def test_the_campaign_sees_other_bits_and_damage(sound: tuple[Path, float], tmp_path: Path) -> None:
    run = shutil.copytree(sound[0], tmp_path / "run")
    other = results(run)
    assert same(results(run), other)
    other["agent"]["loss"]["log_alpha"] += 1e-6
    assert not same(results(run), other)
    assert damaged_checkpoints(run) == 0
    (run / "checkpoint_before.pt").write_bytes(b"half")
    assert damaged_checkpoints(run) == 1


def test_training_goes_by_the_monotonic_clock_alone() -> None:
    for package in (tactile_cube.training, tactile_cube.agent):
        for path in Path(package.__path__[0]).glob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                    assert (node.value.id, node.attr) not in {("time", "time"), ("datetime", "now")}, path
