"""The whole circle: a hand differs from its simulation, a policy fails on it, the cause is found, success comes back.

The "real" hand here is the simulated one with an effect that nobody tells the model of: a torque that pulls q2 of every
finger open, as a return spring would. Every stage is one command of the package, printed before it runs; a stage whose
result is there already is left out, so that the same call goes on after an interruption.

    python examples/circle.py
    python examples/circle.py --smoke    # every stage, as small as it can be: shows that it runs, nothing more
    python examples/circle.py --control  # beside it: the same learning in the world without the effect
    python examples/circle.py --publish outputs/circle    # also copies tables, model and pictures there

Results lie in outputs/circle/: circle.md and circle.json (the table), diagnose/report.html, identify/model.yaml,
finetune/policy.safetensors, after/*.gif.
"""

from __future__ import annotations

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HIDDEN = "torque_bias@q2: bias=-0.2"
"""What the real hand has and the model lacks [N m]."""
POLICY = "table"
"""Name of the policy that comes with the package and turns the cube on a table: the circle is shortest there."""

BENCH = ["source.true_spread=0", "source.nominal.reflected_inertia=0.0015"]  # the simulated hand, but for the effect


@dataclass(frozen=True)
class Sizes:
    """How much of everything.

    Attributes:
        episodes: of an evaluation.
        evaluation: further words of every evaluation.
        bench: words that make the recording small.
        training: words that set the length of the learning.
    """

    episodes: int
    evaluation: tuple[str, ...]
    bench: tuple[str, ...]
    training: tuple[str, ...]


FULL = Sizes(
    episodes=10,
    evaluation=(),
    bench=(),
    training=(
        "training.steps=250000",
        "training.stop_when_angle_above=6",
        "training.learning_starts=6000",
        "training.actor_frozen=3000",  # the policy file brings no critics: they learn first what the policy is worth
    ),
)
SMOKE = Sizes(
    episodes=1,
    evaluation=("protocol.seconds=1",),
    bench=("source.joints=[q2]", "source.duration=3", "source.initialisations=2", "source.kinds=[ramps,multisine]"),
    training=(
        "training.steps=400",
        "training.steps_per_iteration=5",
        "training.barrier_iterations=10",
        "training.updates_per_iteration=2",
        "training.learning_starts=100",
        "training.actor_frozen=4",
        "collector.worlds=4",
        "collector=single",
        "agent.batch_size=32",
        "logger=csv",
    ),
)


class Circle:
    """The stages, in order, in one folder."""

    def __init__(self, folder: Path, sizes: Sizes, policy: str) -> None:
        """Nothing runs yet."""
        self.folder, self.sizes, self.policy = folder, sizes, policy
        self.begin = time.perf_counter()

    def say(self, line: str) -> None:
        """A progress line."""
        print(f"[{time.perf_counter() - self.begin:6.0f} s] {line}", flush=True)

    def run(self, name: str, result: str, title: str, *words: str) -> Path:
        """The path of a result; the command that makes it runs into the folder named first, unless it is there."""
        path = self.folder / result
        finished = self.folder / Path(result).parts[0] / "finished"  # a training writes its policy many times before
        if finished.exists():
            self.say(f"{title}: {path} is there")
            return path
        where = [f"out={path.parent}"] if name == "record" else [f"hydra.run.dir={self.folder / Path(result).parts[0]}"]
        command = ["python", "-m", f"tactile_cube.{name}", *words, *where]
        self.say(f"{title}\n           {shlex.join(command)}")
        done = subprocess.run([sys.executable, *command[1:]], check=False)
        if done.returncode or not path.exists():
            raise SystemExit(f"error: the stage '{title}' ended with status {done.returncode} and without {path}")
        finished.touch()
        return path

    def evaluate(self, name: str, title: str, policy: str, effects: str, film: bool = False) -> dict[str, Any]:
        """Summary of a policy's episodes in a world with these effects."""
        words = [f"policy={policy}", f"effects={effects}", "randomization=one_hand", "seed=1"]
        words += [f"protocol.episodes={self.sizes.episodes}", f"film={str(film).lower()}", *self.sizes.evaluation]
        path = self.run("evaluate", f"{name}/results.json", title, *words)
        summary: dict[str, Any] = json.loads(path.read_text())["variants"][0]["summary"]
        self.say(f"    {summary['mean_angle']:.2f} rad, {summary['successes']} of {summary['episodes']} successful")
        return summary

    def find(self) -> tuple[dict[str, Any], Path]:
        """Record the real hand's finger, see where the model fails, find what is missing and fit it."""
        bench = self.folder / "bench"
        hidden = f"source.hidden=['{HIDDEN}']"
        self.run(
            "record", "bench/recording.yaml", "record a finger of the real hand", hidden, *BENCH, *self.sizes.bench
        )
        self.run("compare", "compare/comparison.json", "compare it with the model", f"recording={bench}")
        answer = self.run("diagnose", "diagnose/diagnosis.json", "which effect is missing?", f"recording={bench}")
        diagnosis: dict[str, Any] = json.loads(answer.read_text())
        named = [f"{one['name']}@{joint}" for one in diagnosis["effects"] for joint in one["joints"]]
        self.say(f"    {diagnosis['verdict']}: {', '.join(named) or 'nothing named'}")
        if not named:
            raise SystemExit(f"the diagnosis names no effect; read {self.folder / 'diagnose/report.html'}")
        effects = f"effects=[{','.join(named)}]"
        model = self.run("identify", "identify/model.yaml", "fit it", f"recording={bench}", effects)
        return diagnosis, model

    def learn(self, name: str, title: str, model: Path | None, like: Path | None = None) -> Path:
        """Go on learning from the policy, in the world of a model or the plain one; as long as run `like` did."""
        first = f"training.init_from={policy_file(self.policy)}"
        world = [f"model={model}"] if model else []
        start = ["training.random_steps=0", "agent.alpha_init=0.015"]  # a trained policy's temperature, nothing random
        words = ["+experiment=table", first, *world, *start, *self.sizes.training]
        if like is not None:
            steps = json.loads((like.parent / "ledger.json").read_text(encoding="utf-8"))["steps"]
            words += [f"training.steps={steps}", "training.stop_when_angle_above=null"]
        return self.run("train", f"{name}/policy.safetensors", title, *words)


def policy_file(name: str) -> Path:
    """Where a policy of that name lies."""
    from tactile_cube.evaluation.policy_path import policy_path

    return policy_path(name)


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown of the evaluations, one row each."""
    lines = ["| policy | hand | mean angle [rad] | successful | cube kept |", "|---|---|---|---|---|"]
    for name, one in rows.items():
        policy, hand = name.split(" on ")
        angle = f"{one['mean_angle']:.2f} +- {one['std_angle']:.2f}"
        of = one["episodes"]
        lines.append(f"| {policy} | {hand} | {angle} | {one['successes']} of {of} | {one['kept']} of {of} |")
    return "\n".join(lines)


def publish(out: Path, folder: Path) -> None:
    """Copy what people look at: tables, diagnosis, model, learning curve, the best episodes before and after."""
    folder.mkdir(parents=True, exist_ok=True)
    for pattern in ("circle.*", "diagnose/diagnosis.json", "identify/model.yaml", "finetune/metrics.csv"):
        for path in out.glob(pattern):
            text = path.read_text(encoding="utf-8").replace(f"{Path.cwd()}/", "")
            (folder / path.name).write_text(text, encoding="utf-8")
    for stage in ("before", "after"):
        for path in out.glob(f"{stage}/*.gif"):
            shutil.copy(path, folder / f"{stage}{path.suffix}")


def main() -> None:
    """Every stage, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("outputs/circle"), help="folder of all results")
    parser.add_argument("--policy", default=POLICY, help="policy to start from: a name, a file or a run's folder")
    parser.add_argument("--control", action="store_true", help="also learn in the world without the effect")
    parser.add_argument("--publish", type=Path, help="folder to copy the tables, the model and the pictures to")
    parser.add_argument("--smoke", action="store_true", help="as small as it can be")
    given = parser.parse_args()
    circle = Circle(given.out, SMOKE if given.smoke else FULL, given.policy)
    real, rows = f'["{HIDDEN}"]', {}
    rows["shipped on plain"] = circle.evaluate("plain", "the policy on the hand of its training", given.policy, "[]")
    film = not given.smoke
    rows["shipped on real"] = circle.evaluate("before", "the same policy on the real hand", given.policy, real, film)
    diagnosis, model = circle.find()
    tuned = circle.learn("finetune", "learn in the world of the model that was found", model)
    rows["fine-tuned with the model on real"] = circle.evaluate(
        "after", "back on the real hand", str(tuned), real, film
    )
    if given.control:
        control = circle.learn("control", "control: learn as long in the plain world", None, like=tuned)
        rows["fine-tuned without it on real"] = circle.evaluate("after_control", "control", str(control), real)
    effects = diagnosis["effects"]
    result = {"hidden": HIDDEN, "verdict": diagnosis["verdict"], "effects": effects, "error": diagnosis["error"]}
    (given.out / "circle.json").write_text(json.dumps(result | {"evaluations": rows}, indent=1), encoding="utf-8")
    (given.out / "circle.md").write_text(table(rows) + "\n", encoding="utf-8")
    if given.publish:
        publish(given.out, given.publish)
    named = ", ".join(f"{one['name']}@{joint}" for one in effects for joint in one["joints"])
    print(f"\nhidden: {HIDDEN}\nfound:  {diagnosis['verdict']}: {named}\n\n{table(rows)}\n\nresults: {given.out}")


if __name__ == "__main__":
    main()
