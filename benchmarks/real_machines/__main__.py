"""Take recordings of real machines through the whole loop and write the table of what was found.

    python -m benchmarks.real_machines DATA [--only emps tx40] [--out outputs/real_machines]

DATA holds the folders of the data sets; README.md beside this file says where they come from and how to add one. A
stage whose result exists is left out, so the same command goes on.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from benchmarks.real_machines.bam_xl330 import BamXl330
from benchmarks.real_machines.dfki_double import DfkiDouble
from benchmarks.real_machines.dfki_pendulum import DfkiPendulum
from benchmarks.real_machines.emps import Emps, official_error
from benchmarks.real_machines.pendulum_torque import PendulumTorque
from benchmarks.real_machines.plain_least_squares import fitted, free_run_error
from benchmarks.real_machines.shadow_lfj3 import ShadowLfj3
from benchmarks.real_machines.so101_sage import So101Sage
from benchmarks.real_machines.tx40 import Tx40
from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.identification.criteria import STANDARD
from tactile_cube.identification.diagnosis import Inquiry, in_steps
from tactile_cube.identification.disturbances import in_time
from tactile_cube.identification.standard_model import fit_standard_model
from tactile_cube.measurement.comparing.error import raw_residuals, summarise_errors
from tactile_cube.measurement.comparing.noise_floor import noise_with_links
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.sources.source import Source

KEY = Path(__file__).parent / "key.yaml"
MACHINES: dict[str, Callable[[Path], Source]] = {
    "emps": lambda data: Emps(str(data / "emps")),
    "dfki_double": lambda data: DfkiDouble(str(data / "dfki_double")),
    "dfki_pendulum": lambda data: DfkiPendulum(str(data / "dfki_pendulum" / "dfki_pendulum.npz")),
    "pendulum_torque": lambda data: PendulumTorque(str(data / "pendulum_torque")),
    "bam_xl330": lambda data: BamXl330(str(data / "bam_xl330" / "xl330.npz")),
    "shadow_lfj3": lambda data: ShadowLfj3(str(data / "shadow_lfj3" / "lfj3_openloop.npz")),
    "so101_roll": lambda data: So101Sage(str(data / "so101_sage"), "Wrist_Roll"),
    "so101_rotation": lambda data: So101Sage(str(data / "so101_sage"), "Rotation"),
    "tx40": lambda data: Tx40(str(data / "tx40")),
}


def command(name: str, out: Path, *words: str) -> None:
    """Run one of the public commands, as a user types it, unless its result is there."""
    if out.is_dir() and any(out.glob("*.json")):
        return
    line = ["python", "-m", f"tactile_cube.{name}", *words, f"hydra.run.dir={out}"]
    print(shlex.join(line), flush=True)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "terminal.txt").open("w") as terminal:
        subprocess.run([sys.executable, *line[1:]], check=True, stdout=terminal, stderr=subprocess.STDOUT)


def loop(name: str, data: Path, out: Path) -> dict[str, Any]:
    """Import, diagnose, and compare what was stated and what was found with trials never fitted."""
    recording, diagnosed = out / name / "recording", out / name / "diagnose"
    if not (recording / "recording.yaml").is_file():
        for part, tables in MACHINES[name](data).recordings(0).items():
            write_recording(recording / part, tables)
    started = time.perf_counter()
    fresh = not (diagnosed / "diagnosis.json").is_file()
    command("diagnose", diagnosed, f"recording={recording}")
    diagnosis = json.loads((diagnosed / "diagnosis.json").read_text())
    errors = {}
    for label, model in (("stated", "null"), ("found", str(diagnosed / "model.yaml"))):
        place = out / name / f"validation_{label}"
        words = (
            f"recording={recording / 'validation'}",
            f"model={model}",
            "band.simulations=0",
            "rerun=false",
        )
        command("compare", place, *words)
        compared = json.loads((place / "comparison.json").read_text())
        errors[label] = {"raw": compared["raw_error"]["overall"], "error": compared["error"]["overall"]}
    named = [
        f"{one['name']}@{joint}"
        for one in diagnosis["effects"] + diagnosis.get("partial_effects", [])
        for joint in one["joints"]
    ]
    answer = {"verdict": diagnosis["verdict"], "named": named, "sets": diagnosis.get("sets", []), "validation": errors}
    answer |= plain(recording, diagnosed / "model.yaml")
    kept = out / name / "seconds.json"
    if fresh:
        kept.write_text(json.dumps(round(time.perf_counter() - started, 1)))
    return answer | {"seconds": json.loads(kept.read_text()) if kept.is_file() else None}


def plain(recording: Path, model: Path) -> dict[str, Any]:
    """Return what the plain methods reach on trials never fitted [rad], nothing removed, and in how many CPU seconds.

    Least squares are for one joint. EMPS has an official error too [m].
    """
    machine, validation = read_recording(recording), read_recording(recording / "validation")
    found = {"standard": standard_error(machine, validation), "plain": None, "plain_seconds": None, "official": None}
    if len(machine.joints) > 1:
        return found
    started = time.process_time()
    error = free_run_error(fitted(machine), validation)
    spent = round(time.process_time() - started, 1)
    official = (
        official_error(validation, nominal_model(validation, read_model(model)))
        if recording.parent.name == "emps"
        else None
    )
    return found | {"plain": error, "plain_seconds": spent, "official": official}


def standard_error(machine: Recording, validation: Recording) -> float:
    """Return the raw RMS error of free runs of the field's standard model, fitted as a diagnosis does first [rad]."""

    def quiet(_: str) -> None:
        pass

    fine = in_steps(in_time(machine, (), quiet), (), None, quiet)
    fitted, held_out, _ = Inquiry(fine, (), 0, quiet, None, STANDARD).parts
    model = fit_standard_model(fitted, held_out, noise_with_links(fine)).model
    runs = free_run(validation, model.with_offsets(nominal_model(validation).offsets))
    errors = raw_residuals(validation.trials, [run.position for run in runs])
    return summarise_errors(errors, validation.joints).overall


def judged(answer: dict[str, Any], key: dict[str, Any]) -> str:
    """How many lines of the key are answered, and what is named that the source says is absent."""
    said = {*answer["named"], *(one for group in answer["sets"] for one in group)}
    answered = sum(any(_matches(effect, said) for effect in line) for line in key["named"])
    wrong = [effect for effect in key.get("not_named", []) if _matches(effect, said)]
    return f"{answered} of {len(key['named'])}" + (f", wrongly {', '.join(wrong)}" if wrong else "")


def _matches(effect: str, said: set[str]) -> bool:
    return any(one == effect or one.partition("@")[0] == effect for one in said)


def table(results: dict[str, dict[str, Any]], key: dict[str, Any]) -> str:
    """The results as Markdown."""
    digest = hashlib.sha256(KEY.read_bytes()).hexdigest()
    lines = [
        f"Answer key: `key.yaml`, SHA-256 `{digest}`. Errors are RMS of free runs from the first state on trials never "
        "fitted, nothing removed, in mrad (mm for `emps`).",
        "",
        "| machine | verdict | named | documented effects named | as stated | plain least squares | "
        "standard model | found | reference | seconds |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, one in results.items():
        stated, found = (f"{1e3 * one['validation'][label]['raw']:.3g}" for label in ("stated", "found"))
        reference = key[name].get("reference")
        least = "-" if one["plain"] is None else f"{1e3 * one['plain']:.3g}"
        beside = f"{reference['value']} {reference['unit']} ({reference['what']})" if reference else "-"
        if one["official"] is not None:
            beside += f"; by its official rule found {1e3 * one['official']:.3g}"
        lines.append(
            f"| {name} | `{one['verdict']}` | {', '.join(one['named']) or '-'} | {judged(one, key[name])} | "
            f"{stated} | {least} | {1e3 * one['standard']:.3g} | "
            f"**{found}** | {beside} | {one['seconds']} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Every machine, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with the data sets")
    parser.add_argument("--out", type=Path, default=Path("outputs/real_machines"))
    parser.add_argument("--only", nargs="+", choices=list(MACHINES), default=list(MACHINES))
    given = parser.parse_args()
    key = yaml.safe_load(KEY.read_text())
    results = {name: loop(name, given.data, given.out) for name in given.only}
    (given.out / "real_machines.json").write_text(json.dumps(results, indent=1))
    (given.out / "real_machines.md").write_text(table(results, key) + "\n")
    print(table(results, key))


if __name__ == "__main__":
    main()
