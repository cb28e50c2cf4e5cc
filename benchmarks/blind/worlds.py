"""The usual blind worlds: three small rigs, how they are measured, and what their owners believe of them."""

import dataclasses
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind import hidden
from benchmarks.blind.excitation import COMMANDS, KINDS
from benchmarks.blind.physics import simulate
from benchmarks.blind.plant import Plant, neutral
from benchmarks.blind.rig import RIGS, Rig

Array = NDArray[np.float64]
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
    skew: float = 0.0
    """Part of a row that positions are read before its end."""
    late: int = 0
    """Rows that a command is logged late."""
    outliers: float = 0.0
    """Share of readings that are nonsense."""


@dataclass
class World:
    """A rig with its true constants, and what its owner believes of them."""

    kind: str
    rig: Rig
    plant: Plant
    nominal: dict[str, Any]
    low: Array
    high: Array
    bound: float = 4.0
    """Positions beyond it are no motion of this machine [rad or m]."""
    step: float | None = None
    """Integration step [s]; None: the engine's own."""
    torque_unit: Array | None = None
    """Torque of each joint in that of a finger; None: as its controller's stiffness."""
    torque_noise: Array | float = 0.002
    """Of the logged torques [N m or N]."""
    homing: float = 1.0
    """Size of the joint offsets, in those of a finger of the same range."""
    time_unit: float = 1.0
    """How much slower than a finger's its commands are."""


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
    nominal: dict[str, Any] = {
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


def draw_usual(
    rng: np.random.Generator, chosen: list[str], seconds: float | None, kind: str | None
) -> tuple[World, Bench, bool]:
    """A rig on which the chosen effects can act, its bench, and whether its excitation is poor."""
    bench, poor = draw_bench(rng, seconds)
    many = any(n in hidden.NEEDS_NEIGHBOUR for n in chosen)
    rigs = ["finger"] if "coupling_error" in chosen else ["finger", "finger", "two_link"] + ["pendulum"] * (not many)
    rig = kind or str(rng.choice(rigs))
    amplitude = float(rng.uniform(0.25, 0.4) if poor and rng.uniform() < 0.5 else rng.uniform(0.7, 1.0))
    return draw_world(rng, rig, amplitude), bench, poor


def command_of(world: World, kind: str, rng: np.random.Generator, samples: int, rate: float) -> Array:
    """A command (samples, joints) of one kind: a finger's, as wide and as slow as this machine moves."""
    unit = world.plant.angle_unit
    return unit * COMMANDS[kind](rng, world.low / unit, world.high / unit, samples, rate * world.time_unit)


def probe(world: World, seed: int, step: float = 5e-4) -> tuple[Array, Array, Array]:
    """Positions, torques and commands of one short motion of every kind, without noise, at 400 Hz of a finger."""
    rng = np.random.default_rng(seed)
    rate, slow = 400.0 / world.time_unit, world.time_unit
    positions, torques, commands = [], [], []
    for kind in KINDS:
        command = command_of(world, kind, rng, 1200, rate)
        start = command[0] - world.plant.offset
        position, torque, _ = simulate(world.rig, world.plant, command, rate, start, 0.3 * slow, step * slow)
        positions.append(position)
        torques.append(torque)
        commands.append(command)
    return np.concatenate(positions), np.concatenate(torques), np.concatenate(commands)
