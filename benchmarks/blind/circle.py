"""The sim-to-real circle, blind: another engine, another contact, drive effects that nobody tells the package of.

    python -m benchmarks.blind.circle --draws 6 --first-seed 500000 --out outputs/blind_circle

The "real" hand of a draw is MuJoCo's, with soft tips, their friction and one or two effects of the drive drawn by
chance; the effects grow until the shipped policy fails. A finger of it is measured on a bench whose physics shares no
code with the package (physics.py). The package is given that recording alone: it is diagnosed, what
is named is fitted, the policy goes on learning in PyBullet in the world of that model (`+experiment=adapt`), and
returns to the real hand. The control learns as long in PyBullet without the model. Every stage is a command of the
package; one that is done is left out, so the same call goes on after an interruption. circle.jsonl has a line for each
draw, circle.md the table.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind.generator import perform, save
from benchmarks.blind.judge import commit, read_lines, validation_error
from benchmarks.blind.plant import Plant, neutral
from benchmarks.blind.rig import Link, Rig
from benchmarks.blind.scoring import score
from benchmarks.blind.worlds import Bench, World

EPISODES, SECONDS = 10, 20
"""Of every evaluation."""
LOST, RESTORED = 5, 8
"""Successful episodes of ten: at most so many and success is lost, at least so many and it is back."""
CONTACT = "tip_friction", "tip_spinning_friction", "tip_compliance"
"""Of the real hand; no training of the package ever saw soft tips."""
SETS, SIZES = 4, 4
"""Sets of effects that a draw may try, each in so many sizes, mild to grave, until one makes the policy fail."""
STATED = {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0, "stiffness": 25.0, "static_friction": 0.02}
INERTIA = 0.0015
"""Rotors' inertia of the simulated hand [kg m^2]."""

Put = Callable[[Plant, int, float], None]


def _put(name: str) -> Put:
    def put(plant: Plant, joint: int, size: float) -> None:
        getattr(plant, name)[joint] = size

    return put


def _more_friction(plant: Plant, joint: int, size: float) -> None:
    plant.static_friction[joint] += size


def _weaker(plant: Plant, joint: int, size: float) -> None:
    """A motor's gain, before the spring that its torque deflects; the blind physics has its own behind it."""
    plant.gain[joint] = 1.0 + size
    plant.stiffness[joint] /= 1.0 + size


EFFECTS: dict[str, tuple[str, float, float, bool, Put]] = {
    "torque_bias": ("bias", 0.1, 0.4, True, _put("bias")),
    "torque_gain": ("error", -0.3, -0.7, False, _weaker),
    "torque_saturation": ("limit", 0.3, 0.08, False, _put("saturation")),
    "backlash": ("gap", 0.05, 0.15, False, _put("backlash")),
    "coulomb_friction": ("friction", 0.1, 0.4, False, _more_friction),
    "viscous_friction": ("damping", 0.3, 1.0, False, _put("viscous")),
    "command_delay": ("delay", 0.04, 0.1, False, _put("delay")),
    "actuator_lag": ("time_constant", 0.02, 0.1, False, _put("lag")),
    "load_dependent_friction": ("coefficient", 0.3, 0.8, False, _put("load_friction")),
}
"""Effect -> its parameter in the package, from mild to grave, either sign or not, what it is in the blind physics.

Sizes that a policy feels, several times those of a good drive.
"""


def finger() -> Rig:
    """A finger of the DLR-Hand II in the blind world's own terms, stretched along x at zero."""
    knuckle = Link("q1", (0, 0, 1), (0, 0, 0), (0, 0, 0), 0.04, (2.773333e-6, 2.773333e-6, 2.88e-6), -0.5236, 0.5236)
    proximal = _bone("q2", 0.0, 0.0366, 0.11, 1.684375e-5, 5.9984375e-5, -0.34907)
    middle = _bone("q3", 0.075, 0.0177, 0.055, 4.6475e-6, 9.657083e-6, -0.17453)
    distal = _bone("q4", 0.04, 0.0202, 0.035, 3.55359e-6, 7.683047e-6, -0.17453, follows="q3")
    return Rig("finger", [knuckle, proximal, middle, distal], (0.0, 0.0, -9.81))


def _bone(
    joint: str, at: float, com: float, mass: float, along: float, across: float, low: float, follows: str | None = None
) -> Link:
    """A link along x that bends about -y."""
    upper = 1.50098 if joint == "q2" else 1.8326
    where = (joint, (0, -1, 0), (at, 0, 0), (com, 0, 0), mass, (along, across, across), low, upper)
    return Link(*where, follows=follows)


def measured(plant: Plant) -> World:
    """The finger on its bench, with the values that its owner believes."""
    nominal = {
        "controller": {key: STATED[key] for key in ("kp", "kd", "torque_limit")},
        "nominal": {key: STATED[key] for key in ("stiffness", "static_friction")} | {"reflected_inertia": INERTIA},
    }
    low, high = np.array([-0.4, -0.15, 0.0]), np.array([0.4, 1.2, 1.3])
    return World("finger", finger(), plant, nominal, low, high)


BENCH = Bench(500.0, 12.0, 3, ("ramps", "multisine", "policy", "steps"), 2e-4, 1e-4, 1.5, 0.0, 0.004)
"""With steps, which ask for all the torque there is: in gentle motion a weak motor cannot be seen."""


def healthy() -> Plant:
    """A finger's drive as stated."""
    drive = {key: np.full(3, value) for key, value in STATED.items()}
    return neutral(3)._replace(**drive, reflected_inertia=np.full(3, INERTIA))


def draw(seed: int, attempt: int) -> dict[str, Any]:
    """Contact and effects of one attempt of a seed; contact is the seed's own, and a set stays while its sizes grow."""
    contact = np.random.default_rng([seed, 1])
    rng = np.random.default_rng([seed, 2, attempt // SIZES])
    sizes = np.random.default_rng([seed, 3, attempt])
    plant, effects, words = healthy(), [], []
    for name in rng.permutation(list(EFFECTS))[: 1 + int(rng.uniform() < 0.4)].tolist():
        key, mild, grave, either, put = EFFECTS[name]
        joint = int(rng.integers(3))
        sign = rng.choice([-1.0, 1.0]) if either else 1.0
        share = (attempt % SIZES + sizes.uniform()) / SIZES
        size = round(float(sign * (mild + share * (grave - mild))), 4)
        put(plant, joint, size)
        absorbed = name in ("coulomb_friction", "viscous_friction")
        truth = {"name": name, "joints": [f"q{joint + 1}"], "parameters": {key: size}, "absorbed": absorbed}
        effects.append({**truth, "in_catalogue": True, "any_joint": False})
        words.append(f"{name}@q{joint + 1}: {key}={size:g}")
    return {
        "tip_friction": round(float(contact.uniform(0.6, 1.1)), 3),
        "tip_spinning_friction": round(float(np.exp(contact.uniform(np.log(1e-3), np.log(1e-2)))), 5),
        "tip_compliance": round(float(np.exp(contact.uniform(np.log(5e-5), np.log(1e-3)))), 6),
        "effects": effects,
        "words": words,
        "plant": plant,
    }


def run(verb: str, folder: Path, result: str, *words: str) -> Path:
    """The result of a command of the package in its folder, unless it has one that is finished."""
    path, finished = folder / result, folder / "finished"
    if finished.exists():
        return path
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", f"tactile_cube.{verb}", *words, f"hydra.run.dir={folder}"]
    with (folder / "words.txt").open("w") as said:
        done = subprocess.run(command, stdout=said, stderr=subprocess.STDOUT, check=False)
    if done.returncode or not path.exists():
        raise SystemExit(f"error: {' '.join(command)} ended with {done.returncode}; read {folder / 'words.txt'}")
    finished.touch()
    return path


def tried(folder: Path, policy: str, hand: dict[str, Any], effects: list[str]) -> dict[str, Any]:
    """How a policy does on the real hand, with these effects or none."""
    quoted = ",".join(f'"{one}"' for one in effects)
    words = [f"policy={policy}", "engine=mujoco", "randomization=one_hand", "seed=1", "film=false"]
    words += [f"effects=[{quoted}]", f"protocol.episodes={EPISODES}", f"protocol.seconds={SECONDS}"]
    words += [f"+env.constants.{key}={hand[key]}" for key in CONTACT]
    summary = json.loads(run("evaluate", folder, "results.json", *words).read_text())["variants"][0]["summary"]
    return {key: summary[key] for key in ("mean_angle", "successes", "kept", "episodes")}


def unhappy(place: Path, seed: int, policy: str) -> tuple[int, dict[str, Any], dict[str, Any]]:
    """The first attempt whose hand the policy fails on, or the last one."""
    for attempt in range(SETS * SIZES):
        hand = draw(seed, attempt)
        before = tried(place / f"before_{attempt}", policy, hand, hand["words"])
        if before["successes"] <= LOST:
            break
    return attempt, hand, before


def learned(folder: Path, policy: str, steps: int, model: Path | None) -> Path:
    """The mean of the last policies of so many steps more in PyBullet, in the world of a model or the stated one."""
    world = [f"model={model}"] if model else []
    words = ["+experiment=adapt", "collector.processes=1", f"training.init_from={policy}", f"training.steps={steps}"]
    run("train", folder, "policy.safetensors", *words, *world)
    mean = folder.with_name(f"{folder.name}_mean")
    return run("average", mean, "policy.safetensors", f"run={folder}", f"output={mean / 'policy.safetensors'}")


def walk(folder: Path, policy: str, steps: int, seed: int) -> dict[str, Any]:
    """One draw: fail, measure, diagnose, fit, learn, return; and learn as long without the model."""
    place = folder / f"draw_{seed}"
    attempt, hand, before = unhappy(place, seed, policy)
    plain = tried(place / "plain", policy, hand, [])
    bench = place / "bench"
    if not (bench / "recording.yaml").is_file():
        world = measured(hand["plant"])
        trials, unseen = perform(seed, world, BENCH)
        save(bench / "validation", world, BENCH, unseen)
        save(bench, world, BENCH, trials)
    words = f"recording={bench}"
    diagnosis = json.loads(run("diagnose", place / "diagnose", "diagnosis.json", *words).read_text())
    found = [*diagnosis["effects"], *diagnosis["partial_effects"]]
    every = [f"{one['name']}@{joint}" for one in found for joint in one["joints"]]
    named = diagnosis["sets"][0] if diagnosis["sets"] else every  # of what is ambiguous, what is recommended
    line = {"seed": seed, "commit": commit(), "policy": policy, "steps": steps, "attempt": attempt + 1}
    line |= {key: hand[key] for key in (*CONTACT, "words")}
    line |= {"verdict": diagnosis["verdict"], "named": named, "plain": plain, "before": before}
    error = validation_error(bench, place / "diagnose" / "model.yaml", place / "unseen")
    floor = float(np.hypot(BENCH.noise, BENCH.resolution / np.sqrt(12.0)))
    line["judged"] = score({"effects": hand["effects"]}, diagnosis, None if error is None else error / floor).outcome
    if before["successes"] > LOST:
        return line  # nothing to win back
    model = None
    if named:
        effects = ",".join(f'"{one}"' for one in named)
        model = run("identify", place / "identify", "model.yaml", f"recording={bench}", f"effects=[{effects}]")
    for name, learned_in in (("after", model), ("control", None)):
        if name == "control" or learned_in is not None:
            policy_now = learned(place / f"learn_{name}", policy, steps, learned_in)
            line[name] = tried(place / name, str(policy_now), hand, hand["words"])
    return line


def page(lines: list[dict[str, Any]], command: str) -> str:
    """The table of all draws."""
    of = [line for line in lines if line["before"]["successes"] <= LOST]
    back = sum(line.get("after", {"successes": 0})["successes"] >= RESTORED for line in of)
    alone = sum(line["control"]["successes"] >= RESTORED for line in of)
    rows = [
        "# The sim-to-real circle, blind",
        "",
        f"Command: `{command}`; commit: {', '.join(sorted({line['commit'] for line in lines}))}. Ten episodes of "
        f"{SECONDS} s on a hand of MuJoCo's with another contact and hidden effects of the drive; learning in "
        "PyBullet, with the model that was found and, as a control, without. "
        f"Success was lost (at most {LOST} of {EPISODES}) on {len(of)} of {len(lines)} hands, "
        f"and came back (at least {RESTORED}) on {back} of them with the model, on {alone} without.",
        "",
        "| seed | tips: friction, spinning [mm], softness [mm/N] | hidden | answer | judged | nothing hidden | lost "
        "| after, with the model | after, without |",
        "|---" * 9 + "|",
    ]
    for line in sorted(lines, key=lambda one: one["seed"]):
        cells = [
            line["seed"],
            f"{line['tip_friction']:g}, {1e3 * line['tip_spinning_friction']:.1f}, {1e3 * line['tip_compliance']:.2f}",
            "; ".join(line["words"]),
            f"`{line['verdict']}`: {', '.join(line['named']) or 'nothing named'}",
            line["judged"],
            *(_cell(line.get(key)) for key in ("plain", "before", "after", "control")),
        ]
        rows.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join([*rows, ""])


def _cell(tried: dict[str, Any] | None) -> str:
    if tried is None:
        return "-"
    return f"{tried['successes']} of {tried['episodes']}, {tried['kept']} kept, {tried['mean_angle']:.1f} rad"


def main() -> None:
    """Walk the draws that are not walked yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=6)
    parser.add_argument("--first-seed", type=int, required=True)
    parser.add_argument("--steps", type=int, default=60_000, help="of learning, with the model and without")
    parser.add_argument("--policy", default="default", help="that comes with the package")
    parser.add_argument("--out", type=Path, default=Path("outputs/blind_circle"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    command = (
        f"python -m benchmarks.blind.circle --draws {args.draws} --first-seed {args.first_seed} --steps {args.steps}"
    )
    done = {line["seed"] for line in read_lines(args.out / "circle.jsonl")}
    for seed in range(args.first_seed, args.first_seed + args.draws):
        if seed not in done:
            line = walk(args.out, args.policy, args.steps, seed)
            with (args.out / "circle.jsonl").open("a") as lines:
                lines.write(json.dumps(line) + "\n")
            print(json.dumps(line), flush=True)
        (args.out / "circle.md").write_text(page(read_lines(args.out / "circle.jsonl"), command))


if __name__ == "__main__":
    main()
