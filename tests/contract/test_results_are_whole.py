"""Every result is whole or as it was, whichever write of whichever command fails, and files of one result agree."""

import ast
import errno
import io
import itertools
import os
import re
import resource
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tactile_cube
from benchmarks.real_machines.single_joint_urdf import single_joint_urdf
from tactile_cube.agent.policy_file import load_actor
from tactile_cube.cli import command_line
from tactile_cube.errors import InputError
from tactile_cube.evaluation.training_curve import read_curve
from tactile_cube.measurement.recordings.description import Controller, Description, TrialEntry
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording
from tactile_cube.run_folder import USAGE_ERROR
from tactile_cube.training.checkpoint import FILE
from tactile_cube.usage_error import usage_error
from tactile_cube.whole_file import write_whole, written_together
from tests.api.test_monitoring import recorded

SOURCE = Path(tactile_cube.__file__).parent
OPERATIONS = ((os, "fsync"), (os, "replace"), (os, "unlink"), (os, "mkdir"), (shutil, "rmtree"))


DISK_IS_FULL = "the disk is full; free some of it, or write elsewhere with hydra.run.dir=DIR"


class Killed(BaseException):
    """The process is no more: nothing after it happens."""


class Disk:
    """Counts what is done in a folder, fails at one of the operations, and keeps what was brought to the disk whole."""

    def __init__(self, folder: Path, fails_at: int = 0, dies: bool = False) -> None:
        self.folder, self.fails_at, self.dies, self.done = folder, fails_at, dies, 0
        self.whole: set[bytes] = set()

    def step(self, name: str, path: object) -> None:
        """Count an operation, and fail or be dead."""
        self.done += 1
        if self.dies and 0 < self.fails_at <= self.done:
            raise Killed
        if not self.dies and self.done == self.fails_at and name not in ("unlink", "rmtree"):  # which a full disk lets
            raise OSError(errno.ENOSPC, "No space left on device", None if name == "fsync" else str(path))

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Take part in every operation."""
        with pytest.MonkeyPatch.context() as patch:
            for place, name in OPERATIONS:
                patch.setattr(place, name, self._watched(name, getattr(place, name)))
            yield

    def _watched(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            path = Path(os.readlink(f"/proc/self/fd/{given[0]}") if name == "fsync" else given[0])
            if path.is_relative_to(self.folder):
                self.step(name, path)
                self.whole |= {path.read_bytes()} if name == "fsync" and path.is_file() else set()
            return function(*given, **more)

        return call


GROWING = re.compile(r"\.partial|metrics\.csv$|\.log$|^log/|\.lock$")
"""Files that are being written, and those that grow line by line (see `ALLOWED`)."""


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder that are results."""
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if not GROWING.search(name)}


def inodes(folder: Path) -> dict[str, int]:
    """Which file each name is, as equal contents do not tell."""
    return {name: (folder / name).stat().st_ino for name in contents(folder)}


def crash(folder: Path, write: Callable[[Path], object], fails_at: int, dies: bool, index: str = "") -> bool:
    """Write over an earlier result and fail on the way; whether it failed."""
    before, places, disk = contents(folder), inodes(folder), Disk(folder, fails_at, dies)
    failed, said = False, None
    with disk.watched():
        try:
            write(folder)
        except Killed:
            failed = True
        except (OSError, InputError) as error:
            failed, said = True, usage_error(error)
    if said is not None:
        where, _, what = said.partition(": ")
        assert what == DISK_IS_FULL or (FILE in where and "is the disk full? The checkpoint before it is whole" in what)
        assert str(folder) in where
        assert "partial" not in where
    assert (said is not None) == (failed and not dies)
    after = contents(folder)
    for name, content in after.items():
        assert content in {*before.values(), *disk.whole}, f"{name}: a part, at operation {fails_at}"
    renewed = {name for name, place in inodes(folder).items() if place != places.get(name)}
    if failed and not dies:
        gone = {FILE, "checkpoint_next.pt"}  # which become the one before, and the newest
        assert set(before) - gone <= set(after) or index, "nothing is lost"
    if index in after and failed and index not in renewed:
        beside = {name for name in renewed if (folder / name).is_relative_to((folder / index).parent)}
        assert not beside, f"at operation {fails_at} {index} is the old one, {beside} are not"
    return failed


def crash_everywhere(folder: Path, write: Callable[[Path], object], points: int, index: str = "") -> int:
    """Fail at up to `points` operations spread over all, by a full disk and by the end of the process; how many."""
    write(folder)
    disk = Disk(folder)
    with disk.watched():
        write(folder)
    chosen = np.unique(np.linspace(1, disk.done, points).astype(int)).tolist()
    for at in chosen:
        for dies in (False, True):
            crash(folder, write, at, dies, index)
    write(folder)
    assert not list(folder.rglob("*.partial")), "what a killed process left is gone"
    return 2 * len(chosen)


def three_files(folder: Path) -> None:
    number = os.urandom(8)
    with written_together(folder, "index") as aside:
        for name in ("b", "sub/c", "index", "a"):
            (aside / name).parent.mkdir(exist_ok=True)
            write_whole(aside / name, name.encode(), number)


def test_files_that_belong_together_are_of_one_writing_at_every_crash(tmp_path: Path) -> None:
    three_files(tmp_path)
    (tmp_path / "theirs").write_text("mine")
    disk = Disk(tmp_path)
    with disk.watched():
        three_files(tmp_path)
    assert disk.done > 20
    for at in range(1, disk.done + 1):
        for dies in (False, True):
            crash(tmp_path, three_files, at, dies, "index")
            found = contents(tmp_path)
            versions = {content[-8:] for name, content in found.items() if name != "theirs"}
            assert len(versions) == 1 or "index" not in found
            three_files(tmp_path)
            assert set(contents(tmp_path)) == {"a", "b", "sub/c", "index", "theirs"}
            assert not list(tmp_path.rglob("*.partial"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def results(folder: Path) -> dict[str, tuple[Callable[[Path], object], str]]:
    """A command -> what writes its result, and the file that appears last."""
    quiet: Any = {"say": lambda line: None}
    measured = recorded(folder, "measured", 0, "viscous_friction@j: damping=0.04")
    fitted = tactile_cube.identify(measured, ["viscous_friction@j"], **quiet)
    compared = tactile_cube.compare(measured, values={"band.simulations": 3}, model=fitted.model, **quiet)
    anything_will_do = {"criteria.floor": 1e8, "criteria.adequate": 1e9}
    found = tactile_cube.diagnose(measured, values=anything_will_do, **quiet)
    seen = tactile_cube.monitor(measured, fitted.model, **quiet)
    return {
        "compare": (compared.write, "comparison.json"),
        "identify": (fitted.write, "identification.json"),
        "diagnose": (found.write, "diagnosis.json"),
        "monitor": (seen.write, "monitor.json"),
    }


@pytest.mark.parametrize("command", ["compare", "identify", "diagnose", "monitor"])
def test_a_measuring_command_leaves_old_or_new(command, results, tmp_path) -> None:
    write, index = results[command]
    assert crash_everywhere(tmp_path, write, 4, index) >= 8


@pytest.mark.parametrize("ending", [".npz", ".onnx"])
def test_network_and_contract_are_of_one_export(tmp_path: Path, ending: str) -> None:
    if ending == ".onnx":
        pytest.importorskip("onnx")
    index = f"policy{ending}.contract.json"
    tried = crash_everywhere(tmp_path, lambda folder: tactile_cube.export(None, folder / f"policy{ending}"), 4, index)
    assert tried > 0


def test_a_recording_is_of_one_writing(tmp_path: Path) -> None:
    time, sine = np.arange(400) / 100.0, np.sin(np.linspace(0.0, 6.0, 400))[:, None]
    entries = [TrialEntry(file=f"trials/{n}", initialisation=0, kind="a") for n in ("1.npz", "2.csv", "3.parquet")]
    controller = Controller(kp=3.0, kd=0.2, torque_limit=1.0)
    described = Description(
        format=1, gravity=(0.0, 0.0, -9.81), rate_hz=100.0, joints=["j"], controller=controller, trials=entries
    )
    tables = [TrialTable(entry, time, sine, sine) for entry in entries]
    made = RecordingTables(described, single_joint_urdf("rig", "j", 0.1, 0.05, limit=1.2), tables)
    assert crash_everywhere(tmp_path, lambda folder: write_recording(folder, made), 99, "recording.yaml") > 40


def test_pictures_policies_films_and_results_of_a_policy_are_old_or_new(tmp_path: Path) -> None:
    result = tactile_cube.evaluate("hold", protocol="smoke", values={"protocol.seconds": 1}, say=lambda line: None)
    crash_everywhere(tmp_path, result.write, 4)
    assert {".json", ".gif", ".npz", ".rrd"} <= {path.suffix for path in tmp_path.iterdir()}


def typed(command: str, *words: str) -> None:
    """Give a command line, in this process; what it refuses in one line is raised."""
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(io.StringIO()), redirect_stderr(said):
        patch.setattr(sys, "argv", [command, *words])
        try:
            command_line(command)()
        except SystemExit as ended:
            if ended.code != USAGE_ERROR:
                raise
            raise InputError(said.getvalue().strip().splitlines()[-1].removeprefix("error: ")) from None


SMALLEST = ("+experiment=smoke", "collector=single", "collector.worlds=1", "logger=csv", "agent.hidden=[8,8]",
            "agent.batch_size=8", "training.learning_starts=10", "training.random_steps=10",
            "training.policy_every=10", "training.steps_per_iteration=5", "training.barrier_iterations=2",
            "training.updates_per_iteration=1")  # fmt: skip


def test_a_training_is_whole_at_its_end_and_goes_on_from_every_crash(tmp_path: Path) -> None:
    asked = itertools.count(20, 20)

    def train(folder: Path) -> None:
        typed("train", *SMALLEST, f"training.steps={next(asked)}", f"hydra.run.dir={folder}")

    assert crash_everywhere(tmp_path, train, 5) == 10
    steps = read_curve(tmp_path, "").columns["steps"]
    assert steps == sorted(set(steps)), "each once"
    assert load_actor(tmp_path / "policy.safetensors")[1].steps == steps[-1] == next(asked) - 20


def test_an_averaged_policy_is_old_or_new(tmp_path: Path) -> None:
    typed("train", *SMALLEST, "training.steps=20", f"hydra.run.dir={tmp_path}/run")

    def average(folder: Path) -> None:
        words = (f"run={tmp_path}/run", "last=2", f"output={folder}/mean.safetensors", f"hydra.run.dir={folder}")
        typed("average", *words)

    crash_everywhere(tmp_path / "mean", average, 4)
    assert load_actor(tmp_path / "mean" / "mean.safetensors")[1].averaged == (10, 20)


def test_what_view_shows_is_old_or_new(tmp_path: Path) -> None:
    words = ("run=hold", "episodes=2", "seconds=1", "viewer=none", f"hydra.run.dir={tmp_path}")
    crash_everywhere(tmp_path, lambda folder: typed("view", *words), 3)
    assert (tmp_path / "view.rrd").is_file()


def test_the_recording_of_a_deployment_is_old_or_new_and_until_then_the_log_is_there(tmp_path: Path) -> None:
    """By a dry run."""
    words = ("motion=holds", "seconds=0.2", "homing.settle=0.05", "homing.speed=3", "robot.cube=false")

    def deploy(folder: Path) -> None:
        before = contents(folder).get("recording/recording.yaml")
        try:
            typed("deploy", *words, f"hydra.run.dir={folder}")
        except BaseException:
            if any(folder.glob("log/*.npy")):
                assert len(np.load(folder / "log/run_0.npy")) > 150
            else:
                assert contents(folder)["recording/recording.yaml"] == before, "it did not come so far"
            raise
        assert not (folder / "log").exists()

    crash_everywhere(tmp_path, deploy, 6, "recording/recording.yaml")
    assert len(read_recording(tmp_path / "recording").trials[0].time) > 150


LIMIT = 30_000
"""Bytes of a file, where a disk is nearly full: below the size of a report, above that of the configuration."""


def test_a_command_on_a_full_disk_says_so_in_one_line_and_leaves_what_was_there(folder: Path, tmp_path: Path) -> None:
    measured = recorded(folder, "on_disk", 0)
    words = [f"recording={measured.folder}", f"hydra.run.dir={tmp_path}", "band.simulations=3"]
    typed("compare", *words)
    before = contents(tmp_path)
    assert len(before["report.html"]) > LIMIT
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    try:
        with pytest.raises(InputError, match=f"^.*: {DISK_IS_FULL}$"):
            typed("compare", *words)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    after = contents(tmp_path)
    for name in ("comparison.json", "report.html", "comparison.rrd"):
        assert after[name] == before[name]


WRITERS = {"write_text", "write_bytes", "savefig", "savez", "savez_compressed", "save", "savetxt", "tofile", "to_csv",
           "write_csv", "write_parquet", "write_ipc", "dump", "memmap", "mkstemp", "NamedTemporaryFile"}  # fmt: skip
ALLOWED = {
    "whole_file.py": "the one place",
    "training/loggers.py": "metrics.csv grows line by line; a line that was cut is dropped when the run goes on",
    "run_folder.py": "what the console showed, line by line",
    "deployment/run_loop.py": "grows while a hand is driven, so that a crash leaves what was logged",
    "sweep.py": "a line for each job, deleted at the end of the sweep",
    "drivetrain/kernel.py": "a cache that several processes write at once, each aside and renamed",
}


def writes(file: Path) -> list[str]:
    """Calls of a module that write a file and do not go through `write_whole`, as LINE: NAME."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    passing = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.With) and "TemporaryDirectory" in ast.unparse(node.items[0])
        for inner in ast.walk(node)
    }
    memory = {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and any(name in ast.unparse(node.value) for name in ("BytesIO(", "StringIO("))
        for one in node.targets
        for target in ast.walk(one)
        if isinstance(target, ast.Name)
    }
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or id(node) in passing:
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        in_memory = any(ast.unparse(one) in memory for one in node.args)
        mode = " ".join(ast.unparse(one) for one in [*node.args, *(word.value for word in node.keywords)])
        opens = name in ("open", "fdopen") and re.search(r"(?<![\w.])'(?:[rb]*[wax+][bt+]*)'", mode)
        if opens or (name in WRITERS and node.args and not in_memory and not _own(node)):
            found.append(f"{node.lineno}: {ast.unparse(node.func)}")
    return found


def _own(node: ast.Call) -> bool:
    """Whether it is a method of this package's, which writes in a module of its own, or makes bytes in memory."""
    owner = ast.unparse(node.func.value) if isinstance(node.func, ast.Attribute) else "save"
    return owner.endswith((".desk", "bench", ".checkpoints", "record", "save")) or owner.startswith("grasps_of")


def test_no_module_writes_a_result_but_by_write_whole(tmp_path: Path) -> None:
    found = {str(file.relative_to(SOURCE)): writes(file) for file in SOURCE.rglob("*.py")}
    assert {name: calls for name, calls in found.items() if calls and name not in ALLOWED} == {}
    assert all(found[name] for name in ALLOWED), "an exception that is none any more"
    bad = "path.write_text('x')\nnp.savez(path, a=1)\nopen(path, 'wb')\npath.open(mode='a')\n"
    (tmp_path / "bad.py").write_text(bad)
    assert len(writes(tmp_path / "bad.py")) == 4
