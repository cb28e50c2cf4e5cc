"""Published measurements of real machines through the whole loop: import, diagnose, and judge on data never fitted.

    python examples/real_data.py data    # folder with the data sets (docs/recordings.md)

Writes outputs/real_data/real_data.json and a table; a stage whose result is there already is left out.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

SOURCES = {
    "so101_roll": ["source=so101_sage", "source.folder={data}/so101_sage", "source.joint=Wrist_Roll"],
    "so101_rotation": ["source=so101_sage", "source.folder={data}/so101_sage", "source.joint=Rotation"],
    "bam_xl330": ["source=bam_xl330", "source.file={data}/bam_xl330/xl330.npz"],
    "shadow_lfj3": ["source=shadow_lfj3", "source.file={data}/shadow_lfj3/lfj3_openloop.npz"],
    "dfki_pendulum": ["source=dfki_pendulum", "source.file={data}/dfki_pendulum/dfki_pendulum.npz"],
    "tx40": ["source=tx40", "source.folder={data}/tx40"],
}
CHANGED = {"dfki_heavier": ("dfki_pendulum", "heavier")}
"""Recordings after something was changed at a machine: diagnosed from the model that was found before."""
NAMED = {
    "bam_xl330": ["load_dependent_friction@servo", "torque_saturation@servo"],
    "shadow_lfj3": ["viscous_friction@LFJ3", "position_torque@LFJ3", "actuator_lag@LFJ3"],
    "tx40": ["viscous_friction", "coulomb_friction", "joint_coupling@joint_5", "joint_coupling@joint_6"],
}
"""Effects that the literature on a machine names, fitted beside what the diagnosis finds by itself."""


def stage(name: str, result: Path, *words: str) -> None:
    """Run a command unless its result is there."""
    if result.exists():
        return
    where = f"out={result.parent}" if name == "record" else f"hydra.run.dir={result.parent}"
    command = ["python", "-m", f"tactile_cube.{name}", *words, where]
    print(shlex.join(command), flush=True)
    subprocess.run([sys.executable, *command[1:]], check=True)


def loop(name: str, data: Path, out: Path) -> dict[str, Any]:
    """All stages of one recording; errors in rad, those under `validation` on trials that nothing was fitted to."""
    recording = out / name / "recording"
    stage("record", recording / "recording.yaml", *(word.format(data=data) for word in SOURCES[name]))
    diagnosed = out / name / "diagnose"
    stage("diagnose", diagnosed / "diagnosis.json", f"recording={recording}")
    models = {"as stated": "null", "diagnosed": str(diagnosed / "model.yaml")}
    if name in NAMED:
        identified = out / name / "identify"
        stage("identify", identified / "model.yaml", f"recording={recording}", f"effects=[{','.join(NAMED[name])}]")
        models["named"] = str(identified / "model.yaml")
    validation = {}
    for label, model in models.items():
        compared = out / name / f"validation_{label.replace(' ', '_')}" / "comparison.json"
        words = [f"recording={recording / 'validation'}", f"model={model}", "band.simulations=0", "rerun=false"]
        stage("compare", compared, *words)
        validation[label] = json.loads(compared.read_text())["error"]["overall"]
    return answer(diagnosed) | {"validation": validation}


def changed(before: str, part: str, name: str, out: Path) -> dict[str, Any]:
    """The diagnosis of a machine that was changed, beginning with the model of the one before."""
    recording, diagnosed = out / before / "recording" / part, out / name / "diagnose"
    model = out / before / "diagnose" / "model.yaml"
    stage("diagnose", diagnosed / "diagnosis.json", f"recording={recording}", f"model={model}")
    return answer(diagnosed) | {"validation": {}}


def answer(diagnosed: Path) -> dict[str, Any]:
    """What a diagnosis answers and the errors of its test part [rad]."""
    diagnosis = json.loads((diagnosed / "diagnosis.json").read_text())
    keys = ("verdict", "effects", "error", "error_part", "noise_floor_source", "held_out", "tested", "seconds")
    kept = {key: diagnosis[key] for key in keys}
    partial = diagnosis.get("partial_effects", [])
    ceilings = {one["joint"]: one["black_box"] for one in diagnosis["unexplained"]}
    return kept | {"partial_effects": partial, "black_box": ceilings}


def main() -> None:
    """Every recording, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder with the data sets")
    parser.add_argument("--out", type=Path, default=Path("outputs/real_data"))
    parser.add_argument("--only", nargs="+", choices=[*SOURCES, *CHANGED], default=[*SOURCES, *CHANGED])
    given = parser.parse_args()
    results = {name: loop(name, given.data, given.out) for name in SOURCES if name in given.only}
    results |= {name: changed(*before, name, given.out) for name, before in CHANGED.items() if name in given.only}
    (given.out / "real_data.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    for name, one in results.items():
        errors = ", ".join(f"{label} {1e3 * error:.3g} mrad" for label, error in one["validation"].items())
        effects = [f"{e['name']}@{','.join(e['joints'])}" for e in one["effects"] + one["partial_effects"]]
        print(f"{name}: {one['verdict']} ({', '.join(effects) or 'nothing named'}); never fitted: {errors}")


if __name__ == "__main__":
    main()
