"""Compare published friction models of servos with ours on runs that ours were never fitted to.

    python -m benchmarks.servos [DATA] [--only sts3215 xl330] [--out outputs/servos]

DATA holds the folders sts3215 and bam_xl330. A servo whose part is there is left out, so the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactile_cube
from benchmarks.servos.friction_ladder import published, simulated
from benchmarks.servos.servo import Run, Servo
from benchmarks.servos.sts3215 import sts3215
from benchmarks.servos.xl330 import xl330
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.model import Model, nominal_model
from tactile_cube.measurement.replay.simulator import free_run

SERVOS: dict[str, Callable[[Path], Servo]] = {
    "sts3215": lambda data: sts3215(data / "sts3215"),
    "xl330": lambda data: xl330(data / "bam_xl330"),
}
RESULTS = Path(__file__).parent / "results"
FRICTION = (["coulomb_friction", "viscous_friction"], ["load_dependent_friction", "viscous_friction"])
"""What is fitted beside the effects that the diagnosis names; MJCF holds the first one."""
Errors = dict[str, float]
"""Run -> mean absolute error of the free run from its first state, nothing removed [rad]."""


def recorded(servo: Servo, runs: Sequence[Run], folder: Path) -> Path:
    """Runs with one load as a recording."""
    if not (folder / "recording.yaml").is_file():
        write_recording(folder, servo.recording(runs))
    return folder


def mean_errors(runs: Sequence[Run], positions: Sequence[NDArray[np.float64]]) -> Errors:
    """The error of each run."""
    pairs = zip(runs, positions, strict=True)
    return {run.name: float(np.abs(position - run.position).mean()) for run, position in pairs}


def our_errors(servo: Servo, out: Path, model: Model | None) -> Errors:
    """The error of each run, simulated with a model of ours that was found with another load, or with what is stated.

    A recording states its trials' gains as parts of its own; the model's effects and constants are those of the servo.
    """
    found: Errors = {}
    for load in sorted({run.load for run in servo.runs}):
        runs = [run for run in servo.runs if run.load == load]
        recording = read_recording(recorded(servo, runs, out / f"{load[0]:.3g}kg_{1e3 * load[1]:.0f}mm"))
        trials = free_run(recording, nominal_model(recording) if model is None else model)
        for trial, simulation in zip(recording.trials, trials, strict=True):
            found[trial.name] = float(np.abs(simulation.position - trial.position).mean())
    return found


def measured(servo: Servo, out: Path) -> dict[str, Any]:
    """Errors of all models, and what the diagnosis said."""
    started = time.process_time()
    errors = {
        name: mean_errors(servo.runs, simulated(servo, servo.runs, p)) for name, p in published(servo.name).items()
    }
    fitted = [run for run in servo.runs if run.fitted]
    driven = recorded(servo, [run for run in fitted if run.driven], out / "fitted_driven")
    found = tactile_cube.diagnose(driven)
    found.write(out / "diagnosis")
    assert found.free is not None
    errors |= {
        "stated": our_errors(servo, out, None),
        "standard model": our_errors(servo, out, found.free.standard.model),
        "diagnosis": our_errors(servo, out, found.free.fitted.model),
    }
    whole, models = recorded(servo, fitted, out / "fitted"), {}
    for friction in FRICTION:
        effects = list(dict.fromkeys([*(name.partition("@")[0] for name in found.effects), *friction]))
        fit = tactile_cube.identify(whole, effects)
        assert fit.free is not None
        name = f"diagnosis, {' and '.join(friction)} fitted"
        fit.write(out / friction[0])
        errors[name] = our_errors(servo, out, fit.free.fitted.model)
        models[name] = fit.text
        print(tactile_cube.export_model(fit.model, "mjcf", out / f"{friction[0]}.xml", recording=whole).text)
    return {
        "errors": {name: by_kind(servo.runs, one) for name, one in errors.items()},
        "repeats": repeats(servo.runs),
        "runs": {"fitted": len(fitted), "never fitted": len(servo.runs) - len(fitted)},
        "verdict": found.verdict,
        "effects": found.text,
        "models": models,
        "CPU seconds": round(time.process_time() - started),
    }


def by_kind(runs: Sequence[Run], errors: Errors) -> dict[str, dict[str, float]]:
    """Mean error of the runs of each kind [mrad], fitted and not, and of all kinds with equal weight."""
    table = {}
    for part in (True, False):
        kinds = sorted({run.kind for run in runs if run.fitted == part})
        row = {k: mean(errors[run.name] for run in runs if run.kind == k and run.fitted == part) for k in kinds}
        row["mean"] = mean(row.values())
        table["fitted" if part else "never fitted"] = {kind: round(1e3 * value, 2) for kind, value in row.items()}
    return table


def repeats(runs: Sequence[Run]) -> dict[str, float]:
    """Median over conditions of the mean absolute difference between two runs of one [mrad]."""
    found: dict[str, list[float]] = {}
    for one, other in combinations(runs, 2):
        if (one.kind, one.gain, one.load) == (other.kind, other.gain, other.load):
            rows = min(len(one.time), len(other.time))
            found.setdefault(one.kind, []).append(float(np.abs(one.position[:rows] - other.position[:rows]).mean()))
    return {kind: round(1e3 * median(values), 2) for kind, values in found.items()}


def table(result: dict[str, Any]) -> str:
    """Errors on runs never fitted as Markdown."""
    rows = {name: parts["never fitted"] for name, parts in result["errors"].items()}
    kinds = list(next(iter(rows.values())))
    lines = [f"| model | {' | '.join(kinds)} |", "|---" * (len(kinds) + 1) + "|"]
    rows["two runs of one condition"] = result["repeats"]
    for name, row in rows.items():
        lines.append(f"| {name} | {' | '.join(f'{row[kind]:.1f}' if kind in row else '-' for kind in kinds)} |")
    return "\n".join(lines)


def main() -> None:
    """Every servo, then the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"), help="folder with the data sets")
    parser.add_argument("--out", type=Path, default=Path("outputs/servos"))
    parser.add_argument("--only", nargs="+", choices=list(SERVOS), default=list(SERVOS))
    given = parser.parse_args()
    for name in given.only:
        file = RESULTS / f"{name}.json"
        if not (given.out / name / "diagnosis" / "diagnosis.json").is_file() or not file.is_file():
            result = measured(SERVOS[name](given.data), given.out / name)
            RESULTS.mkdir(exist_ok=True)
            file.write_text(json.dumps(result, indent=1) + "\n")
        result = json.loads(file.read_text())
        print(f"{name}: {result['verdict']}; MAE of free runs never fitted [mrad]\n\n{table(result)}\n")


if __name__ == "__main__":
    main()
