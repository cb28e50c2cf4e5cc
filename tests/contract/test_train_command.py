"""The command line of train, as a user types it."""

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from hydra.core.plugins import Plugins

from tactile_cube.agent.policy_file import load_actor
from tactile_cube.composition import with_recipe
from tactile_cube.evaluation.policy_path import SHIPPED
from tactile_cube.training.checkpoint import load_checkpoint
from tests.typed import typed

ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}


def train(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tactile_cube.train", *arguments]
    return subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=280)


def loaded_modules(argument: str, folder: Path) -> tuple[set[str], str]:
    """Modules that a call of train leaves loaded, and what it printed."""
    code = (
        f"import sys; sys.argv = ['train', {argument!r}, 'job'][:{2 if argument == '--help' else 3}]\n"
        "from tactile_cube.train import main\nmain()\n"
        "print('MODULES', *sys.modules, file=sys.stderr)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=60
    )
    assert run.returncode == 0, run.stderr
    return set(run.stderr.split("MODULES")[1].split()), run.stdout


def test_help_lists_verbs_and_groups_without_importing_anything_slow(tmp_path: Path) -> None:
    modules, text = loaded_modules("--help", tmp_path)
    assert not modules & {"torch", "torchrl", "pybullet", "hydra"}
    for word in ("python -m tactile_cube.train", "task=", "table", "experiment=", "curriculum", "agent=", "plain_sac"):
        assert word in text


def test_cfg_job_shows_the_configuration_without_importing_torch(tmp_path: Path) -> None:
    modules, text = loaded_modules("--cfg", tmp_path)
    assert not modules & {"torch", "torchrl", "pybullet"}
    assert "name: curriculum" in text


@pytest.mark.parametrize(
    ("words", "taken"),
    [
        ([], ["+experiment=curriculum"]),
        (["seed=1"], ["+experiment=curriculum", "seed=1"]),
        (["seed=1", "-m"], ["+experiment=curriculum", "seed=1", "-m"]),
        (["--cfg", "job", "+task.x=1"], ["--cfg", "job", "+experiment=curriculum", "+task.x=1"]),
        (["-m", "+experiment=table1"], ["-m", "+experiment=table1"]),
        (["seed=1", "+experiment=paper"], ["seed=1", "+experiment=paper"]),
    ],
)
def test_train_takes_the_recipe_unless_an_experiment_is_named(words: list[str], taken: list[str]) -> None:
    assert with_recipe("train", words) == taken
    assert with_recipe("evaluate", words) == words


def test_fine_tuning_goes_on_from_the_shipped_policy(tmp_path: Path) -> None:
    few = ["+experiment=finetune", "collector=single", "collector.worlds=2", "logger=csv"]
    few += ["training.steps=40", "training.learning_starts=10", "training.replay_size=1000", "agent.batch_size=16"]
    few += ["training.steps_per_iteration=5", "training.barrier_iterations=4", "training.updates_per_iteration=2"]
    run = typed("train", *few, folder=tmp_path)
    assert run.returncode == 0, run.stderr
    assert "default.safetensors; critics begin anew, the actor waits for 3000 updates" in run.stdout
    files = (tmp_path / "outputs/train/finetune-seed0/policy.safetensors", SHIPPED / "default.safetensors")
    mine, shipped = (load_actor(file)[0].state_dict() for file in files)
    assert mine.keys() == shipped.keys()
    assert all((mine[name] - shipped[name]).abs().max() < 0.01 for name in mine)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["training.init_from=nobody"], "training.init_from=nobody: no such file"),
        (["+experiment=papr"], "did you mean experiment=paper?"),
        (["+experimnt=paper"], "experimnt: no such setting of train; --help lists them; did you mean experiment?"),
        (["task"], "task: settings are KEY=VALUE; did you mean task=OPTION?"),
        (["+experiment=smoke", "collector.worlds=0"], "error: collector.worlds=0: Input should be greater than 0\n"),
    ],
)
def test_wrong_choices_and_values_end_with_one_line_exit_code_2_and_no_folder(tmp_path, arguments, message) -> None:
    run = typed("train", *arguments, folder=tmp_path)
    assert (run.returncode, run.stderr.count("\n"), run.stderr.startswith("error: ")) == (2, 1, True)
    assert message in run.stderr
    assert not list(tmp_path.glob("outputs/train/*/*"))


def test_a_refused_command_leaves_the_folder_of_a_run_that_was_there_as_it_was(tmp_path: Path) -> None:
    folder = tmp_path / "outputs/train/smoke-seed0"
    (folder / ".hydra").mkdir(parents=True)
    before = {".hydra/config.yaml": "seed: 0\n", ".hydra/overrides.yaml": "- seed=0\n", "metrics.csv": "steps\n"}
    for name, text in before.items():
        (folder / name).write_text(text)
    run = typed("train", "+experiment=smoke", "collector.worlds=0", folder=tmp_path)
    assert (run.returncode, run.stderr.count("\n"), run.stderr.startswith("error: ")) == (2, 1, True)
    assert {name: (folder / name).read_text() for name in before} == before
    assert "error: collector.worlds=0" in (folder / "train.log").read_text()


def test_smoke_run_trains_resumes_and_leaves_its_files(tmp_path: Path) -> None:
    short = ["+experiment=smoke", "collector=single", "collector.worlds=4", "training.learning_starts=100"]
    short += ["agent.precision=bf16"]
    first = train(*short, "training.steps=200", folder=tmp_path)
    assert first.returncode == 0, first.stderr
    folder = tmp_path / "outputs/train/smoke-seed0"
    present = {path.name for path in folder.iterdir()}
    assert {"checkpoint.pt", "metrics.csv", "policy.safetensors", "ledger.json", ".hydra"} <= present
    configuration = (folder / ".hydra/config.yaml").read_text()
    assert "worlds: 4" in configuration
    assert "training.steps=200" in (folder / ".hydra/overrides.yaml").read_text()
    assert "bf16" in first.stdout
    second = typed("train", *short, "training.steps=400", folder=tmp_path)
    assert second.returncode == 0, second.stderr
    assert "goes on at 200 steps" in second.stdout
    log = (folder / "train.log").read_text()
    for line in [*first.stdout.splitlines(), *second.stdout.splitlines()]:
        assert line in log
    assert any((folder / "tensorboard").iterdir())
    steps = [int(line.split(",")[0]) for line in (folder / "metrics.csv").read_text().splitlines()[1:]]
    assert steps == list(range(40, 401, 40))


def test_another_loss_of_torchrl_is_a_file_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "my_conf/agent/mine.yaml"
    file.parent.mkdir(parents=True)
    loss = "{_target_: torchrl.objectives.TQCLoss, _partial_: true, top_quantiles_to_drop_per_net: 1}"
    file.write_text(f"defaults: [sac, _self_]\ncritics: 3\nquantiles: 7\nloss: {loss}\n")
    short = ["--config-dir", "my_conf", "agent=mine", "+experiment=smoke", "collector=single", "collector.worlds=4"]
    short += ["training.learning_starts=100"]
    for steps in (160, 200):  # the second goes on
        run = typed("train", *short, f"training.steps={steps}", folder=tmp_path)
        assert run.returncode == 0, run.stderr
        assert f"all {steps} steps done" in run.stdout
    learned = load_checkpoint(tmp_path / "outputs/train/smoke-seed0/checkpoint.pt")["learner"]
    assert learned["counters"]["updates"] > 0
    assert (3, 7) in [tuple(value.shape) for value in learned["agent"]["loss"].values()]  # biases of the last layers


def test_a_sweep_keeps_its_record_in_its_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = (
        "import sys\nfrom pathlib import Path\nfrom tactile_cube import cli, commands\n"
        "def seen(job): print([*map(str, Path().rglob('.sweep-*'))], [*map(str, Path().iterdir())])\n"
        "sys.argv = ['export', '-m', 'name=one,two']\ncommands.export = seen\ncli.command_line('export')()"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert re.search(r"\['outputs/export/\.sweep-\w+'\] \['outputs'\]", run.stdout)
    assert not list(tmp_path.rglob(".sweep-*"))


def test_a_sweeper_is_given_the_objective_of_each_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "hydra_plugins").mkdir()
    (tmp_path / "hydra_plugins" / "searching.py").write_text(
        "from hydra._internal.core_plugins.basic_sweeper import BasicSweeper\n"
        "class Searching(BasicSweeper):\n"
        "    def sweep(self, arguments):\n"
        "        print('objectives', *[run.return_value for run in super().sweep(arguments)[0]])\n"
    )
    words = ["policy=hold", "protocol=smoke", "protocol.seconds=0.2", "film=false", "seed=0,-1"]
    monkeypatch.syspath_prepend(tmp_path)
    Plugins.instance().register(import_module("hydra_plugins.searching").Searching)  # found as a process starts
    sweeper = "hydra.sweeper._target_=hydra_plugins.searching.Searching"
    run = typed("evaluate", "-m", *words, sweeper, folder=tmp_path)
    assert run.returncode == 1  # the second seed is refused, and has no objective
    first, second = next(line for line in run.stdout.splitlines() if line.startswith("objectives")).split()[1:]
    assert abs(float(first)) < 1.0
    assert second == "None"


@pytest.mark.parametrize("words", [["train", "--cfg", "job"], ["--help"]])
def test_a_reader_that_leaves_ends_a_command_quietly(words: list[str], tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "tactile_cube", *words]
    run = subprocess.run(command, cwd=tmp_path, stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (run.returncode, run.stderr) == (141, b"")


def test_a_sweep_goes_past_a_run_that_fails_says_what_came_of_it_and_is_given_again_for_the_rest(tmp_path) -> None:
    short = ["+experiment=smoke", "collector=single", "collector.worlds=4", "training.steps=80", "logger=csv"]
    first = typed("train", "-m", *short, "seed=0,-1", folder=tmp_path)
    assert first.returncode == 1
    assert "error: seed=-1" in first.stderr
    assert "1 of 2 runs failed: " in first.stderr
    sweep = tmp_path / "outputs/train/smoke"
    setting = "collector.worlds=4-collector=single-logger=csv"
    assert {path.name for path in sweep.iterdir()} == {f"{setting}-seed0", "learning_curves.png"}
    assert f"| {setting} | > 0.000 (at" in first.stdout
    checkpoint = sweep / f"{setting}-seed0/checkpoint.pt"
    written = checkpoint.stat().st_mtime_ns
    second = typed("train", "-m", *short, "seed=0,1", folder=tmp_path)
    assert second.returncode == 0, second.stderr
    assert "finished before (all 80 steps done)" in second.stdout
    assert checkpoint.stat().st_mtime_ns == written
    assert (sweep / f"{setting}-seed1/finished.json").is_file()
    assert second.stdout.count(f"| {setting} |") == 1
