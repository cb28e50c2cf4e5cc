"""Write the pages of the documentation that the code knows better: commands, configuration, effects, API.

python docs/generate.py            # docs/commands.md, configuration.md, effects.md with its pictures, api.md
python docs/generate.py --pictures # draws each effect's signature anew, for the workbench too (some minutes)
"""

from __future__ import annotations

import inspect
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

import tactile_cube
from tactile_cube.api.effects import COLUMNS, effects
from tactile_cube.composition import CONFIG, commands
from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.errors import InputError

DOCS = Path(__file__).parent
PICTURES = Path(tactile_cube.__file__).parent / "visualization" / "effects"
JOINT = "q2"
ELSEWHERE = {"coupling_error": "q3"}
"""Effects whose picture is of another joint: q2 leads none."""


def main() -> None:
    """Write the pages, and the pictures if they are asked for."""
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")
    if "--pictures" in sys.argv:
        write_pictures()
    shutil.copytree(PICTURES, DOCS / "images" / "effects", dirs_exist_ok=True)


def effects_page() -> str:
    """The glossary: what each effect is, where it acts, its parameters, its picture."""
    lines = [
        "# Effects of the catalogue",
        "",
        "Every effect is one class, used in training, in simulation and in the search for what a model lacks.",
        "The pictures show measured minus simulated angle where the model lacks the effect. A simulated finger of the",
        f"hand has it at its typical size on {JOINT} (a coupling's on the joint that leads). It moves by ramps (slow",
        "strokes and reversals) and a multisine (0.2 to 6 Hz), without noise. Grey is the command; scales differ.",
        "`python docs/generate.py --pictures` draws them anew.",
        "",
        "Name one as `NAME@JOINT` in `effects=[...]` of [identify](match.md), or a class of your own by its path",
        "([own effect](own_effect.md)). `python -m tactile_cube.effects name=NAME` shows one in a terminal.",
        "",
        "| effect | acts on | in a line |",
        "|---|---|---|",
    ]
    lines += [f"| [{one.name}](#{one.name}) | {one.acts_on} | {_cell(one.summary)} |" for one in effects()]
    for one in effects():
        lines += ["", f"## {one.name}", "", one.summary, "", one.law, "", *_table(COLUMNS, one.rows)]
        for title, note in one.notes.items():
            lines += ["", f"**{title}**: {note}"]
        if (PICTURES / f"{one.name}.png").is_file():
            lines += ["", f"![signature of {one.name}](images/effects/{one.name}.png)"]
    return "\n".join(lines) + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(map(_cell, row)) + " |" for row in cells]


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def commands_page() -> str:
    """Every command with its file, as it stands in conf/."""
    lines = [
        "# Commands",
        "",
        "`tactile-cube NAME` and `python -m tactile_cube.NAME` are the same. `--help` lists groups and keys,",
        "`--cfg job` shows the configuration, `-m` runs every combination of comma-separated values.",
    ]
    for name, summary in commands().items():
        lines += ["", f"## {name}", "", summary, "", *_listing(CONFIG / f"{name}.yaml")]
    return "\n".join(lines) + "\n"


def configuration_page() -> str:
    """Every group's options, as they stand in conf/."""
    lines = [
        "# Configuration",
        "",
        "`group=option` chooses a file of `conf/`, `key=value` a value in it, `+experiment=option` several at once.",
    ]
    for group in sorted(path for path in CONFIG.iterdir() if path.is_dir() and path.name != "hydra"):
        lines += ["", f"## {group.name}"]
        for file in sorted(group.glob("*.yaml")):
            lines += ["", f"`{group.name}={file.stem}`", "", *_listing(file)]
    return "\n".join(lines) + "\n"


def api_page() -> str:
    """Every public function and class with its signature and docstring."""
    lines = ["# API", "", "Everything is imported as `tactile_cube.NAME`. [Python](python.md) shows it in use."]
    for name in tactile_cube.__all__:
        one = getattr(tactile_cube, name)
        given = "(message)" if one is InputError else inspect.signature(one)
        lines += ["", f"## {name}", "", "```text", f"{name}{given}", "", inspect.getdoc(one) or "", "```"]
    return "\n".join(lines) + "\n"


def _listing(file: Path) -> list[str]:
    text = file.read_text(encoding="utf-8")
    yaml.safe_load(text)
    return ["```yaml", *text.rstrip().splitlines(), "```"]


PAGES = {
    "commands.md": commands_page,
    "configuration.md": configuration_page,
    "effects.md": effects_page,
    "api.md": api_page,
}
"""Name of each generated page in docs/, and what writes it."""


def write_pictures() -> None:
    """Simulate the finger with and without each effect, and draw the difference."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    PICTURES.mkdir(parents=True, exist_ok=True)
    motions = ("ramps", "multisine")
    for name, rows in signatures(motions).items():
        figure, axes = pyplot.subplots(1, 2, figsize=(7.2, 2.1), layout="constrained")
        for axis, motion, (time, command, residual) in zip(axes, motions, rows, strict=True):
            axis.plot(time, residual, color="#1f5fa8", linewidth=0.9)
            axis.set(title=motion, xlabel="time [s]", ylabel="difference [mrad]")
            axis.title.set_fontsize(9)
            beside = axis.twinx()
            beside.plot(time, command, color="#bbbbbb", linewidth=0.8, zorder=0)
            beside.set_yticks([])
        figure.savefig(PICTURES / f"{name}.png", dpi=80)
        pyplot.close(figure)
        print(PICTURES / f"{name}.png", flush=True)


def signatures(motions: tuple[str, ...]) -> dict[str, list[tuple[object, object, object]]]:
    """Effect -> for each motion time [s], command [rad] and residual [mrad] of its joint."""
    import numpy as np

    from tactile_cube.api.job import worded_job
    from tactile_cube.measurement.recordings.description import TrialEntry
    from tactile_cube.measurement.replay.model import Model, terms_of
    from tactile_cube.measurement.replay.simulator import Simulator
    from tactile_cube.measurement.sources.simulated_rig import SimulatedRig, silent_trial, unmeasured

    config = worded_job("record", ("source=finger", "out=unused")).config.source
    source = SimulatedRig(
        controller=config.controller, nominal=config.nominal, true_spread=0.0, duration=6.0, reach=0.5
    )
    rig = source.rig()
    description = source.description(rig)
    constants = source.true_constants(tuple(description.joints), np.random.default_rng(0))
    empty = unmeasured(description, rig, constants)
    rng, trials = np.random.default_rng(3), []
    for motion in motions:
        command = source.free_command(motion, rig, description.joints, rng)
        trials.append(silent_trial(command, empty, TrialEntry(file=f"{motion}.parquet", kind=motion)))
    found: dict[str, list[tuple[object, object, object]]] = {}
    joints = tuple(description.joints)
    simulator, still = Simulator(empty, step=0.001), {0: np.zeros(len(joints))}
    for name, kind in catalogue().items():
        joint = ELSEWHERE.get(name, JOINT)
        label, place = f"{name}@{joint}", joints.index(joint)
        plain = {p.name: p.neutral for p in kind.parameters}
        typical = (kind.forms[0] if kind.forms else {}) or {p.name: p.typical for p in kind.parameters}
        models = [Model(constants, terms_of([(label, v)], joints), still) for v in (plain, plain | typical)]
        without, with_effect = simulator.free_runs(models, trials)
        found[name] = [
            (trial.time, trial.command[:, place], 1e3 * (b.position - a.position)[:, place])
            for trial, a, b in zip(trials, without, with_effect, strict=True)
        ]
        print(name, flush=True)
    return found


if __name__ == "__main__":
    main()
