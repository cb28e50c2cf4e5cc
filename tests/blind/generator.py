"""Draw a rig with (or without) something hidden in it and write what its bench would have recorded.

    python tests/blind/generator.py --seed 7 --out FOLDER

writes FOLDER/recording (the documented recording format, with fresh commands in recording/validation) and, beside it
and never inside it, FOLDER/truth.json. Nothing here comes from the package under test.
"""

import argparse
import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import hidden
import numpy as np
import polars as pl
import yaml
from excitation import KINDS
from numpy.typing import NDArray
from physics import Plant, neutral, simulate
from rig import RIGS, Rig

Array = NDArray[np.float64]
CYCLE = ("none", "named", "named", "unnamed", "named", "named", "two", "named")
"""Which kind of truth each seed hides, in turn."""
ATTEMPTS = 4
"""Worlds that a seed may draw until one runs through all its trials; some effects drive their joint."""
VISIBLE = 1.5
"""A visible effect moves its joint by at least this multiple of the sensor noise, refitted constants removed."""
CONSTANTS = {
    "finger": {
        "kp": (3.2, 4.5),
        "kd": (0.2, 0.3),
        "stiffness": (20, 32),
        "friction": (0.015, 0.03),
        "inertia": (0.0022, 0.004),
    },
    "pendulum": {
        "kp": (5, 8),
        "kd": (0.25, 0.4),
        "stiffness": (40, 80),
        "friction": (0.02, 0.04),
        "inertia": (0.003, 0.006),
    },
    "two_link": {
        "kp": (4, 7),
        "kd": (0.25, 0.35),
        "stiffness": (30, 60),
        "friction": (0.02, 0.035),
        "inertia": (0.003, 0.006),
    },
}
MOTION = {
    "finger": [(-0.35, 0.35), (-0.1, 1.1), (-0.05, 1.2)],
    "pendulum": [(-1.5, 1.5)],
    "two_link": [(-1.2, 1.2)] * 2,
}


@dataclass
class Bench:
    """How the rig was measured."""

    rate: float
    seconds: float
    initialisations: int
    kinds: tuple[str, ...]
    noise: float
    resolution: float
    settle: float
    dropped: float
    start_error: float


@dataclass
class World:
    """A rig with its true constants, and what its owner believes of them."""

    kind: str
    rig: Rig
    plant: Plant
    nominal: dict[str, Any]
    low: Array
    high: Array


def draw_bench(rng: np.random.Generator, seconds: float | None) -> tuple[Bench, bool]:
    """A bench and whether its excitation is poor (two kinds of trial only, or small motions)."""
    poor = bool(rng.uniform() < 0.12)
    kinds = tuple(KINDS) if not poor else tuple(rng.permutation(list(KINDS))[:2].tolist())
    bench = Bench(
        rate=float(rng.choice([500, 500, 500, 250, 1000])),
        seconds=float(rng.choice([6.0, 8.0, 12.0])) if seconds is None else seconds,
        initialisations=int(rng.choice([2, 3, 3, 4])),
        kinds=kinds,
        noise=float(rng.uniform(1e-4, 4e-4)),
        resolution=float(rng.choice([1e-4, 1e-4, 3e-4])),
        settle=float(rng.choice([0.0, 1.5])),
        dropped=float(rng.choice([0.0, 0.0, 0.0, 0.0, 0.01])),
        start_error=0.004,
    )
    return bench, poor


def draw_world(rng: np.random.Generator, kind: str, amplitude: float) -> World:
    """A rig, its stated values, and true constants that differ a little from them."""
    rig = RIGS[kind](rng)
    n = len(rig.actuated)
    stated = {name: float(np.round(rng.uniform(*span), 5)) for name, span in CONSTANTS[kind].items()}
    limit = 1.0 if kind == "finger" else 2.5
    off = lambda share: 1.0 + rng.uniform(-share, share, n)  # noqa: E731
    plant = neutral(n)._replace(
        kp=np.full(n, stated["kp"]),
        kd=stated["kd"] * off(0.1),
        torque_limit=np.full(n, limit),
        stiffness=np.full(n, stated["stiffness"]),
        static_friction=stated["friction"] * off(0.25),
        reflected_inertia=stated["inertia"] * off(0.15),
    )
    span = np.array(MOTION[kind])
    middle, half = span.mean(axis=1), 0.5 * amplitude * (span[:, 1] - span[:, 0])
    nominal = {
        "controller": {"kp": stated["kp"], "kd": stated["kd"], "torque_limit": limit},
        "nominal": {
            "stiffness": stated["stiffness"],
            "static_friction": stated["friction"],
            "reflected_inertia": stated["inertia"],
        },
    }
    if rng.uniform() < 0.3:
        nominal["controller"]["kp"] = [stated["kp"]] * n
    return World(kind, rig, plant, nominal, middle - half, middle + half)


def copy(world: World) -> World:
    """A world whose rig and plant can be changed without touching the original."""
    rig = dataclasses.replace(world.rig, links=list(world.rig.links))
    return replace(world, rig=rig, plant=Plant(*(x.copy() for x in world.plant)))


def probe(world: World, seed: int, step: float = 5e-4) -> tuple[Array, Array, Array]:
    """Positions, torques and commands of one short motion of every kind, without noise, at 400 Hz."""
    rng = np.random.default_rng(seed)
    positions, torques, commands = [], [], []
    for make in KINDS.values():
        command = make(rng, world.low, world.high, 1200, 400.0)
        start = command[0] - world.plant.offset
        position, torque, _ = simulate(world.rig, world.plant, command, 400.0, start, 0.3, step)
        positions.append(position)
        torques.append(torque)
        commands.append(command)
    return np.concatenate(positions), np.concatenate(torques), np.concatenate(commands)


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
    near.plant.offset[joint] += 0.01
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
    world: World, name: str, rng: np.random.Generator, strength: float, seed: int, noise: float
) -> tuple[World, dict[str, Any]]:
    """The world with one effect more, and the truth about it."""
    changed = copy(world)
    n = len(world.rig.actuated)
    joint = int(rng.integers(n))
    if name in hidden.WHOLE_RIG:
        joint = n - 1
    _, torque, command = probe(world, seed)
    trials = command.reshape(len(KINDS), -1, n)
    speed = np.abs(np.diff(trials, axis=1)).max(axis=(0, 1)) * 400.0
    scene = hidden.Scene(
        changed.rig, changed.plant, world.low, world.high, np.abs(torque).max(axis=0), speed, rng, strength
    )
    make = hidden.NAMED.get(name) or hidden.UNNAMED[name]
    joints = [joint]
    if name == "command_delay" and n > 1 and rng.uniform() < 0.4:
        joints = list(range(n))
    parameters = make(scene, joint)
    for other in joints:
        changed.plant.delay[other] = changed.plant.delay[joint]
    truth = {
        "name": name,
        "joints": [world.rig.actuated[i] for i in joints],
        "parameters": parameters,
        "in_catalogue": name in hidden.NAMED,
        "absorbed": name in hidden.ABSORBED,
        "any_joint": name in hidden.WHOLE_RIG,
        **visibility(world, changed, joint, noise, seed),
    }
    return changed, truth


def names_for(seed: int, rng: np.random.Generator) -> tuple[str, list[str]]:
    """What the seed hides: its kind of truth and the names of the effects, cycling through all of them."""
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
    seed: int, seconds: float | None = None, names: list[str] | None = None, kind: str | None = None, redrawn: int = 0
) -> tuple[World, Bench, dict[str, Any]]:
    """The world, the bench and the truth of one seed; `names` and `kind` force what is hidden and where."""
    rng = np.random.default_rng([seed, 20231212, redrawn] if redrawn else [seed, 20231212])
    label, chosen = names_for(seed, rng)
    if names is not None:
        label, chosen = "forced", names
    strength = float(rng.uniform(0.15, 1.0))
    best: tuple[float, World, Bench, dict[str, Any]] | None = None
    for attempt in range(4):
        bench, poor = draw_bench(rng, seconds)
        many = any(n in hidden.NEEDS_NEIGHBOUR for n in chosen)
        rigs = (
            ["finger"] if "coupling_error" in chosen else ["finger", "finger", "two_link"] + ["pendulum"] * (not many)
        )
        rig = kind or str(rng.choice(rigs))
        world = draw_world(
            rng, rig, float(rng.uniform(0.25, 0.4) if poor and rng.uniform() < 0.5 else rng.uniform(0.7, 1.0))
        )
        floor = float(np.hypot(bench.noise, bench.resolution / np.sqrt(12)))
        effects = []
        for name in chosen:
            world, truth = hide(world, name, rng, strength if attempt == 0 else 1.0, seed, floor)
            effects.append(truth)
        weakest = min((e["signal"] if e["absorbed"] else e["distinct"] for e in effects), default=np.inf)
        reached = np.abs(probe(world, seed)[0]).max()
        sane = bool(np.isfinite(reached) and reached < 4.0)
        truth = {
            "seed": seed,
            "kind": label,
            "rig": rig,
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
    return simulate if name == "own" else import_module(f"{name}_physics").simulate  # type: ignore[no-any-return]


def _table(
    world: World, bench: Bench, command: Array, start: Array, rng: np.random.Generator, engine: str
) -> pl.DataFrame:
    """One trial as its log: sensors with noise and resolution, some rows lost."""
    position, torque, _ = _engine(engine)(world.rig, world.plant, command, bench.rate, start, bench.settle)
    position = position + bench.noise * rng.normal(size=position.shape)
    position = np.round(position / bench.resolution) * bench.resolution
    torque = torque + 0.002 * rng.normal(size=torque.shape)
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


def _save(folder: Path, world: World, bench: Bench, tables: dict[str, tuple[int, str, pl.DataFrame]]) -> None:
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


def perform(seed: int, world: World, bench: Bench, engine: str = "own") -> tuple[Tables, Tables]:
    """The trials, file -> (initialisation, kind, table), and unseen ones of the last initialisation."""
    rng = np.random.default_rng([seed, 7])
    n, samples = len(world.rig.actuated), int(bench.seconds * bench.rate)
    offsets = rng.uniform(-1, 1, (bench.initialisations, n)) * np.deg2rad(rng.uniform(0.5, 3.0))
    commands = {kind: KINDS[kind](rng, world.low, world.high, samples, bench.rate) for kind in bench.kinds}
    fresh = {kind: make(rng, world.low, world.high, samples, bench.rate) for kind, make in KINDS.items()}

    def record(init: int, command: Array) -> pl.DataFrame:
        there = copy(world)
        there.plant.offset[:] += offsets[init]
        command = command.astype(np.float32).astype(float)
        start = command[0] - there.plant.offset + bench.start_error * rng.uniform(-1, 1, n)
        return _table(there, bench, command, start, rng, engine)

    tables = {}
    for init in range(bench.initialisations):
        for kind_of, command in commands.items():
            tables[f"trials/{kind_of}_{init}.parquet"] = (init, kind_of, record(init, command))
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
) -> dict[str, Any]:
    """Draw the seed and write `out`/recording and `out`/truth.json; returns the truth."""
    for redrawn in range(ATTEMPTS):
        world, bench, truth = draw(seed, seconds, names, kind, redrawn)
        tables, unseen = perform(seed, world, bench, engine)
        if all(np.isfinite(table.to_numpy()).all() for _, _, table in (*tables.values(), *unseen.values())):
            break
    else:
        raise RuntimeError(f"seed {seed}: no finite recording in {ATTEMPTS} attempts")
    _save(out / "recording", world, bench, tables)
    _save(out / "recording" / "validation", world, bench, unseen)
    truth["repeat_scatter"] = repeat_scatter(tables, world.rig.actuated)
    (out / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, help="length of every trial")
    args = parser.parse_args()
    print(json.dumps(write(args.seed, args.out, args.seconds)["effects"], indent=1))
