"""What each command of the terminal writes and prints; its settings are conf/<name>.yaml and the function's keywords.

The first line of a docstring is what `--help` says. Nothing slow is imported before a command runs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_cube.run_folder import INTERRUPTED

if TYPE_CHECKING:
    from tactile_cube.api.job import Job


def average(job: Job) -> None:
    """Average the weights of the last policies that a training run has kept."""
    from tactile_cube.api.training import run_averaging

    made = run_averaging(job)
    print(f"mean of the weights after {', '.join(map(str, made.steps))} steps: {made.policy}")
    print(f"see it turn: python -m tactile_cube.evaluate policy={made.policy}")


def compare(job: Job) -> None:
    """Simulate a recording's commands and show how far model and measurement are apart, and where."""
    from tactile_cube.api.comparison import run_comparison

    result = run_comparison(job, job.config.recording, job.config.model)
    result.write(job.folder, job.config.rerun)
    print(f"{result.text}\nreport: {job.folder / 'report.html'}")


def deploy(job: Job) -> None:
    """Run a policy's control loop on a hand: a dry run on the simulated one, or ROS 2."""
    import shutil

    from tactile_cube.api.deployment import run_deployment
    from tactile_cube.api.job import shown_at_once

    log = job.folder / "log"
    result = run_deployment(job, shown_at_once, log)
    print(result.text)
    recording = result.write(job.folder / "recording")
    shutil.rmtree(log, ignore_errors=True)  # it is the recording now
    if recording is not None:
        print(f"log: {recording}")
        if job.config.motion != "policy":  # else fingers touch the object, of which the recording says nothing
            print(f"next: python -m tactile_cube.compare recording={recording}")
    if result.runs[-1].interrupted:
        sys.exit(INTERRUPTED)


def diagnose(job: Job) -> None:
    """Find which physical effect a model lacks, from a recording of the machine."""
    from tactile_cube.api.diagnosis import run_diagnosis

    found = run_diagnosis(job, job.config.recording, job.config.model)
    print(found.text, flush=True)
    found.write(job.folder, job.config.report)
    files = {"report": "report.html", "model": "model.yaml", "diagnosis": "diagnosis.json"}
    for name in files if job.config.report else ("model", "diagnosis"):
        print(f"{name}: {job.folder / files[name]}")


def effects(job: Job) -> None:
    """List the physical effects that a model can have, or explain one: law, parameters, what it looks like in data."""
    from tactile_cube.api.effects import effects, effects_table

    found = effects(job.config.name)
    print(effects_table(found) if job.config.name is None else found[0].text)


def evaluate(job: Job) -> float:
    """Evaluate a policy: a verdict for every episode, a film of the best one.

    Returns:
        Mean angle of the first condition [rad], a sweep's objective.
    """
    from tactile_cube.api.evaluation import run_evaluation
    from tactile_cube.api.job import shown_at_once

    result = run_evaluation(job, shown_at_once)
    print(result.text)
    result.write(job.folder, job.config.film)
    return result.summary.mean_angle


def export(job: Job) -> None:
    """Write a policy for a robot, or an identified model for another simulator."""
    if job.config.model is not None or job.config.format is not None:
        from tactile_cube.api.identification import run_model_export

        print(run_model_export(job).text)
        return
    from tactile_cube.api.deployment import run_export

    output, contract = run_export(job)
    print(f"{output}\ncontract: {contract}")


def identify(job: Job) -> None:
    """Fit a rig's constants and the effects that you name."""
    from tactile_cube.api.identification import run_identification

    found = run_identification(job, job.config.recording)
    print(found.text, flush=True)
    found.write(job.folder)
    print(f"model: {job.folder / 'model.yaml'}\nreport: {job.folder / 'report.html'}")


def monitor(job: Job) -> None:
    """Say whether a machine has changed since its model was identified: known numbers that drift, or something new."""
    from tactile_cube.api.monitoring import run_monitor

    result = run_monitor(job, job.config.recording, job.config.model)
    print(result.text)
    result.write(job.folder)


def record(job: Job) -> None:
    """Write a recording, from a simulated rig with hidden effects or from files of other programs."""
    from tactile_cube.api.comparison import run_recording

    run_recording(job)
    print(f"next: python -m tactile_cube.compare recording={job.config.out}")


def train(job: Job) -> float:
    """Train a policy; the same command resumes it.

    What a run writes into its folder: metrics.csv, tensorboard/, policy.safetensors (latest) and
    policy_best.safetensors, trial.gif, checkpoint.pt and checkpoint_before.pt (to go on from), train.log (what the
    console showed), ledger.json (CPU-hours), finished.json (how it ended) and .hydra/ (configuration). A training in
    stages has a folder like it for each stage in its own, and bullet/ and mujoco/ with the judgement.

    Returns:
        Mean angle of the last training episodes [rad], a sweep's objective.
    """
    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from tactile_cube.api.training import run_training
    from tactile_cube.training.collection import CollectionError
    from tactile_cube.training.run import INTERRUPTED as STOPPED

    try:
        result = run_training(job)
    except CollectionError as error:
        print(f"error: {error}; the same command goes on from the last checkpoint in {job.folder}", file=sys.stderr)
        sys.exit(1)
    if result.reason == STOPPED and HydraConfig.get().mode == RunMode.MULTIRUN:
        sys.exit(INTERRUPTED)  # else Ctrl-C would end one run of a sweep and start the next
    return result.final_angle


def view(job: Job) -> None:
    """See the best and the worst episode of a run side by side, and its learning curves."""
    from tactile_cube.api.evaluation import run_view
    from tactile_cube.api.job import shown_at_once

    print(run_view(job, shown_at_once).text)


def workbench(job: Job) -> None:
    """Compare model and measurement in a browser, add what is missing, and watch the error fall."""
    from tactile_cube.workbench.server import serve

    serve(job)


def compare_trainings(folders: list[Path]) -> None:
    """Summarise the runs of a sweep."""
    from tactile_cube.evaluation.training_curve import read_sweep, sweep_table
    from tactile_cube.visualization.charts import write_sweep_curves

    for sweep in dict.fromkeys(folder.parent for folder in folders):
        runs, picture = read_sweep(sweep), sweep / "learning_curves.png"
        write_sweep_curves(runs, picture, sweep.name)
        print(f"\n{sweep}\n\n{sweep_table(runs)}\n\nlearning curves: {picture}")


AFTER_SWEEP: dict[str, Callable[[list[Path]], None]] = {"train": compare_trainings}
"""Command -> what follows its sweeps, given the folders of the runs that succeeded."""
