"""Draw a rig with (or without) something hidden in it and write what its bench would have recorded.

    python -m benchmarks.blind.generator --seed 7 --out FOLDER

writes FOLDER/recording (the documented recording format, with fresh commands in recording/validation) and, beside it
and never inside it, FOLDER/truth.json. Nothing here comes from the package under test.
"""

import argparse
import dataclasses
import json
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import polars as pl
import yaml
from numpy.typing import NDArray

from benchmarks.blind import hidden, logs, pairs, sizes
from benchmarks.blind.excitation import KINDS
from benchmarks.blind.forms import BESIDE, FAMILIES
from benchmarks.blind.physics import simulate
from benchmarks.blind.worlds import Bench, World, command_of, copy, draw_usual, probe

Array = NDArray[np.float64]
CYCLE = ("none", "named", "named", "unnamed", "named", "named", "two", "named")
"""Which kind of truth each seed hides, in turn."""
ATTEMPTS = 4
"""Worlds that a seed may draw until one runs through all its trials; some effects drive their joint."""
VISIBLE = 1.5
"""A visible effect moves its joint by at least this multiple of the sensor noise, refitted constants removed."""
WORLDS = {
    "usual": draw_usual, "sizes": sizes.draw_machine, "forms": draw_usual, "logs": logs.draw_log,
    "pairs": pairs.draw_pair, "twins": pairs.draw_twin,
}  # fmt: skip
"""What may be measured: the usual rigs, machines of any size, the usual rigs with laws as other authors write them, the
usual rigs with controllers and logs as strangers have them, two joints with an effect each, one joint with a twin."""


def visibility(plain: World, changed: World, joint: int, noise: float, seed: int) -> dict[str, float]:
    """RMS that the change moves its joint by [noise]: all of it, and what refitted constants cannot imitate."""
    reference = probe(plain, seed)[0]
    columns = [np.zeros(reference.shape) for _ in reference.T]
    for i, column in enumerate(columns):
        column[:, i] = 1.0
    for name, share in (("kd", 0.05), ("static_friction", 0.2), ("reflected_inertia", 0.1), ("stiffness", 0.1)):
        near = copy(plain)
        getattr(near.plant, name)[joint] *= 1.0 + share
        columns.append(probe(near, seed)[0] - reference)
    near = copy(plain)
    near.plant.offset[joint] += 0.01 * near.plant.angle_unit[joint]
    columns.append(probe(near, seed)[0] - reference)
    moved = probe(changed, seed)[0] - reference
    if not np.isfinite(moved).all():
        return {"signal": 0.0, "distinct": 0.0}
    basis = np.stack([c.ravel() for c in columns], axis=1)
    basis /= np.linalg.norm(basis, axis=0) + 1e-12
    left = moved.ravel() - basis @ np.linalg.lstsq(basis, moved.ravel(), rcond=None)[0]
    rms = lambda x: float(np.sqrt((x.reshape(reference.shape)[:, joint] ** 2).mean()) / noise)  # noqa: E731
    return {"signal": rms(moved.ravel()), "distinct": rms(left)}


def hide(
    world: World,
    name: str,
    rng: np.random.Generator,
    strength: float,
    seed: int,
    noise: float,
    place: int | None = None,
) -> tuple[World, dict[str, Any]]:
    """The world with one effect more, at a place if it is given, and the truth about it."""
    changed = copy(world)
    n = len(world.rig.actuated)
    joint = int(rng.integers(n)) if place is None else place
    if name in hidden.WHOLE_RIG:
        joint = n - 1
    _, torque, command = probe(world, seed)
    trials = command.reshape(len(KINDS), -1, n)
    speed = np.abs(np.diff(trials, axis=1)).max(axis=(0, 1)) * 400.0 / world.time_unit
    scene = hidden.Scene(
        changed.rig,
        changed.plant,
        world.low,
        world.high,
        np.abs(torque).max(axis=0),
        speed,
        rng,
        strength,
        world.torque_unit,
        world.time_unit,
    )
    others = FAMILIES | logs.MAKERS
    make, family = others.get(name) or (hidden.NAMED.get(name) or hidden.UNNAMED[name], ())
    joints = [joint]
    if name in logs.EVERY_JOINT or (name == "command_delay" and place is None and n > 1 and rng.uniform() < 0.4):
        joints = list(range(n))
    parameters = make(scene, joint)
    for other in joints:
        changed.plant.delay[other] = changed.plant.delay[joint]
    truth = {
        "name": name,
        "joints": [world.rig.actuated[i] for i in joints],
        "parameters": parameters,
        "in_catalogue": name in hidden.NAMED or name in others,
        "absorbed": name in hidden.ABSORBED,
        "any_joint": name in hidden.WHOLE_RIG + logs.WHOLE_RIG,
        **visibility(world, changed, joint, noise, seed),
    }
    if family:
        truth |= {"names": list(family), "beside": list(BESIDE.get(name, ()))}
    if n == 1 and name in logs.TWINS:
        truth["twins"] = list(logs.TWINS[name])
    return changed, truth


def names_for(seed: int, rng: np.random.Generator, worlds: str = "usual") -> tuple[str, list[str]]:
    """What the seed hides: its kind of truth and the names of the effects, cycling through all of them."""
    if worlds == "forms":  # nothing in every sixth
        turn = seed - seed // 6 - 1
        return ("form", [list(FAMILIES)[turn % len(FAMILIES)]]) if seed % 6 else ("none", [])
    if worlds == "logs":
        kind = list(logs.TURNS)[seed % len(logs.TURNS)]
        return kind, list(logs.TURNS[kind])
    if worlds == "pairs":
        return "two", [names[seed % len(names)] for names in (pairs.COMMAND, pairs.FRICTION)]
    if worlds == "twins":
        return "named", [list(pairs.TWINS)[seed % len(pairs.TWINS)]]
    kind = CYCLE[seed % len(CYCLE)]
    turn = seed // len(CYCLE) * CYCLE.count(kind) + CYCLE[: seed % len(CYCLE)].count(kind)
    if kind == "none":
        return kind, []
    if kind == "named":
        return kind, [list(hidden.NAMED)[turn * 11 % len(hidden.NAMED)]]
    if kind == "unnamed":
        return kind, [list(hidden.UNNAMED)[turn % len(hidden.UNNAMED)]]
    apart = [n for n in hidden.NAMED if n not in hidden.ABSORBED + hidden.WHOLE_RIG + hidden.ALONE]
    return kind, rng.choice(apart, 2, replace=False).tolist()


def draw(
    seed: int,
    seconds: float | None = None,
    names: list[str] | None = None,
    kind: str | None = None,
    redrawn: int = 0,
    worlds: str = "usual",
) -> tuple[World, Bench, dict[str, Any]]:
    """The world, the bench and the truth of one seed; `names` and `kind` force what is hidden and where."""
    rng = np.random.default_rng([seed, 20231212, redrawn] if redrawn else [seed, 20231212])
    label, chosen = names_for(seed, rng, worlds)
    if names is not None:
        label, chosen = "forced", names
    strength = float(rng.uniform(0.15, 1.0))
    best: tuple[float, World, Bench, dict[str, Any]] | None = None
    for attempt in range(4):
        world, bench, poor = WORLDS[worlds](rng, chosen, seconds, kind)
        floor = float(np.hypot(bench.noise, bench.resolution / np.sqrt(12)))
        effects = []
        n = len(world.rig.actuated)
        places: list[int | None] = [int(rng.integers(n)) if worlds == "logs" else None] * len(chosen)
        if worlds == "pairs":
            places = rng.permutation(n)[: len(chosen)].tolist()
        for name, place in zip(chosen, places, strict=True):
            if name in logs.LOG_FAULTS:
                continue
            world, truth = hide(world, name, rng, strength if attempt == 0 else 1.0, seed, floor, place)
            if worlds == "twins":
                truth["twins"] = list(pairs.TWINS[name])
            effects.append(truth)
        weakest = min((e["signal"] if e["absorbed"] else e["distinct"] for e in effects), default=np.inf)
        reached = np.abs(probe(world, seed)[0]).max()
        sane = bool(np.isfinite(reached) and reached < world.bound)
        truth = {
            "seed": seed,
            "kind": label,
            "rig": world.kind,
            "poor_excitation": poor,
            "visible": bool(weakest >= VISIBLE),
            "drawn": attempt + 1,
            "effects": effects,
            "bench": dataclasses.asdict(bench),
            "sensor_floor": floor,
        }
        if sane and (best is None or weakest > best[0]):
            best = (weakest, world, bench, truth)
        if sane and weakest >= VISIBLE:
            break
    if best is None:
        raise RuntimeError(f"seed {seed}: no stable world in four attempts")
    return best[1:]


def _engine(name: str) -> Callable[..., tuple[Array, Array, Array]]:
    """What moves the measured rig: `own` (physics.py) or `mujoco`."""
    return simulate if name == "own" else import_module(f"benchmarks.blind.{name}_physics").simulate  # type: ignore[no-any-return]


def _table(
    world: World, bench: Bench, command: Array, start: Array, rng: np.random.Generator, engine: str
) -> pl.DataFrame:
    """One trial as its log: sensors with noise and resolution, some rows lost."""
    step = {} if world.step is None else {"step": world.step}
    position, torque, _ = _engine(engine)(world.rig, world.plant, command, bench.rate, start, bench.settle, **step)
    position = position + bench.noise * rng.normal(size=position.shape)
    position = np.round(position / bench.resolution) * bench.resolution
    if bench.outliers:
        off = rng.choice([-logs.OFF, logs.OFF], position.shape) * world.plant.angle_unit
        position += np.where(rng.uniform(size=position.shape) < bench.outliers, off, 0.0)
    command = np.concatenate([np.repeat(command[:1], bench.late, axis=0), command[: len(command) - bench.late]])
    torque = torque + world.torque_noise * rng.normal(size=torque.shape)
    columns: dict[str, Array] = {"time": np.arange(len(command)) / bench.rate}
    for i, joint in enumerate(world.rig.actuated):
        columns[f"{joint}.command"] = command[:, i].astype(np.float32)
        columns[f"{joint}.position"] = position[:, i].astype(np.float32)
        columns[f"{joint}.torque"] = torque[:, i].astype(np.float32)
    keep = rng.uniform(size=len(command)) >= bench.dropped
    keep[0] = True
    return pl.DataFrame(columns).filter(pl.Series(keep))


def _describe(world: World, bench: Bench, trials: list[dict[str, Any]]) -> dict[str, Any]:
    """recording.yaml as plain data."""
    coupled = {x.joint: {"joint": x.follows, "ratio": 1.0} for x in world.rig.links if x.follows}
    return {
        "format": 1,
        "rig": "rig.urdf",
        "gravity": list(world.rig.gravity),
        "rate_hz": int(bench.rate),
        "joints": world.rig.actuated,
        "coupled": coupled,
        **world.nominal,
        "sensors": {"position_resolution": bench.resolution},
        "trials": trials,
    }


def save(folder: Path, world: World, bench: Bench, tables: dict[str, tuple[int, str, pl.DataFrame]]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, (_, _, table) in tables.items():
        (folder / name).parent.mkdir(exist_ok=True)
        table.write_parquet(folder / name)
    trials = [{"file": name, "initialisation": init, "kind": kind} for name, (init, kind, _) in tables.items()]
    (folder / "recording.yaml").write_text(yaml.safe_dump(_describe(world, bench, trials), sort_keys=False))
    (folder / "rig.urdf").write_text(world.rig.urdf())


def repeat_scatter(tables: dict[str, tuple[int, str, pl.DataFrame]], joints: list[str]) -> float:
    """RMS over all joints of repeats of one command about their mean, each trial's own offset removed [rad]."""
    squares, count = 0.0, 0
    for wanted in {kind for _, kind, _ in tables.values()}:
        repeats = [t for _, kind, t in tables.values() if kind == wanted]
        common = set.intersection(*(set(t["time"].to_list()) for t in repeats))
        aligned = np.stack(
            [
                t.filter(pl.col("time").is_in(sorted(common))).select([f"{j}.position" for j in joints]).to_numpy()
                for t in repeats
            ]
        ).astype(float)
        aligned -= aligned.mean(axis=1, keepdims=True)
        left = aligned - aligned.mean(axis=0)
        squares += (left**2).sum() * len(repeats) / (len(repeats) - 1)
        count += left.size
    return float(np.sqrt(squares / count))


Tables = dict[str, tuple[int, str, pl.DataFrame]]


def _offsets(world: World, bench: Bench, rng: np.random.Generator) -> Array:
    """Joint offsets (initialisations, n) by which the robot finds its zeros [rad]."""
    offsets = rng.uniform(-1, 1, (bench.initialisations, len(world.rig.actuated))) * np.deg2rad(rng.uniform(0.5, 3.0))
    return np.asarray(offsets * world.plant.angle_unit * world.homing)


def draw_pushes(seed: int, count: int, world: World, bench: Bench) -> dict[tuple[int, str], dict[str, Any]]:
    """Which trials, (initialisation, kind), somebody pushes in, each once: joint, start and length [s], torque [N m].

    As hard as it takes to hold a joint 3 to 11 degrees of a finger away against its controller, for 0.3 to 1 s.
    """
    rng = np.random.default_rng([seed, 13])
    trials = [(init, kind) for init in range(bench.initialisations) for kind in bench.kinds]
    found = {}
    for place in rng.permutation(len(trials))[:count]:
        joint = int(rng.integers(len(world.rig.actuated)))
        angle = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.2) * world.plant.angle_unit[joint]
        found[trials[int(place)]] = {
            "joint": world.rig.actuated[joint],
            "start": float(rng.uniform(0.1, 0.7) * bench.seconds),
            "seconds": float(rng.uniform(0.3, 1.0) * world.time_unit),
            "torque": float(angle * world.plant.kp[joint]),
        }
    return found


def _pushed(world: World, push: dict[str, Any] | None) -> World:
    """The world with a push at its joint, or as it is."""
    if push is None:
        return world
    there, joint = copy(world), world.rig.actuated.index(push["joint"])
    there.plant.push[joint], there.plant.push_start[joint] = push["torque"], push["start"]
    there.plant.push_seconds[joint] = push["seconds"]
    return there


def _record(
    world: World, bench: Bench, offset: Array, command: Array, rng: np.random.Generator, engine: str
) -> pl.DataFrame:
    """The log of one command, played after an initialisation with this offset."""
    there = copy(world)
    there.plant.offset[:] += offset
    there.plant.early[:] = bench.skew / bench.rate
    command = command.astype(np.float32).astype(float)
    start_error = bench.start_error * rng.uniform(-1, 1, len(offset)) * there.plant.angle_unit
    return _table(there, bench, command, command[0] - there.plant.offset + start_error, rng, engine)


def perform(
    seed: int,
    world: World,
    bench: Bench,
    engine: str = "own",
    pushes: Mapping[tuple[int, str], dict[str, Any]] = MappingProxyType({}),
) -> tuple[Tables, Tables]:
    """The trials, file -> (initialisation, kind, table), and unseen ones of the last initialisation, never pushed."""
    rng = np.random.default_rng([seed, 7])
    samples = int(bench.seconds * bench.rate)
    offsets = _offsets(world, bench, rng)
    commands = {kind: command_of(world, kind, rng, samples, bench.rate) for kind in bench.kinds}
    fresh = {kind: command_of(world, kind, rng, samples, bench.rate) for kind in KINDS}

    def record(init: int, command: Array, push: dict[str, Any] | None = None) -> pl.DataFrame:
        return _record(_pushed(world, push), bench, offsets[init], command, rng, engine)

    tables = {}
    for init in range(bench.initialisations):
        for kind_of, command in commands.items():
            table = record(init, command, pushes.get((init, kind_of)))
            tables[f"trials/{kind_of}_{init}.parquet"] = (init, kind_of, table)
    last = bench.initialisations - 1
    unseen = {f"{kind_of}.parquet": (last, kind_of, record(last, command)) for kind_of, command in fresh.items()}
    return tables, unseen


def write(
    seed: int,
    out: Path,
    seconds: float | None = None,
    names: list[str] | None = None,
    kind: str | None = None,
    engine: str = "own",
    worlds: str = "usual",
    pushes: int = 0,
) -> dict[str, Any]:
    """Draw the seed and write `out`/recording and `out`/truth.json; returns the truth. `pushes` trials are pushed."""
    if engine != "own" and worlds != "usual":
        raise ValueError(f"--engine {engine} moves the usual worlds only, got --worlds {worlds}; leave --engine out")
    for redrawn in range(ATTEMPTS):
        world, bench, truth = draw(seed, seconds, names, kind, redrawn, worlds)
        pushed = draw_pushes(seed, pushes, world, bench)
        tables, unseen = perform(seed, world, bench, engine, pushed)
        if all(np.isfinite(table.to_numpy()).all() for _, _, table in (*tables.values(), *unseen.values())):
            break
    else:
        raise RuntimeError(f"seed {seed}: no finite recording in {ATTEMPTS} attempts")
    save(out / "recording", world, bench, tables)
    save(out / "recording" / "validation", world, bench, unseen)
    truth["redrawn"] = redrawn
    left_alone = perform(seed, world, bench, engine)[0] if pushed else tables
    truth["repeat_scatter"] = repeat_scatter(left_alone, world.rig.actuated)
    truth["pushes"] = [{"trial": f"{kind_of}_{init}", **push} for (init, kind_of), push in pushed.items()]
    (out / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


def play(
    out: Path,
    commands: Path,
    seconds: float | None = None,
    engine: str = "own",
    worlds: str = "usual",
) -> None:
    """Play a command file on the rig that `write` has put into `out`, and add the trial to its recording."""
    truth = json.loads((out / "truth.json").read_text())
    seed, redrawn = truth["seed"], truth["redrawn"]
    world, bench, _ = draw(seed, seconds, redrawn=redrawn, worlds=worlds)
    offset = _offsets(world, bench, np.random.default_rng([seed, 7]))[-1]  # still as the robot was initialised last
    command = pl.read_csv(commands).select([f"{joint}.command" for joint in world.rig.actuated]).to_numpy()
    table = _record(world, bench, offset, command, np.random.default_rng([seed, 8]), engine)
    if not np.isfinite(table.to_numpy()).all():
        raise RuntimeError(f"seed {seed}: {commands} has no finite answer")
    description = out / "recording" / "recording.yaml"
    data = yaml.safe_load(description.read_text())
    name = "trials/next_experiment.parquet"
    table.write_parquet(out / "recording" / name)
    data["trials"].append({"file": name, "initialisation": bench.initialisations - 1, "kind": "next_experiment"})
    description.write_text(yaml.safe_dump(data, sort_keys=False))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, help="length of every trial")
    parser.add_argument("--worlds", choices=tuple(WORLDS), default="usual")
    args = parser.parse_args()
    print(json.dumps(write(args.seed, args.out, args.seconds, worlds=args.worlds)["effects"], indent=1))
