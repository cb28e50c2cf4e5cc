"""Machines of any size: a hundredth of a newton metre to a thousand, a third of them sliding, one to three joints.

Payload and lever (or carriage and stroke) are drawn logarithmically over what exists; then what designer and bench
chose for that machine: bandwidth, damping, friction, gears, encoder, rates, range, speed. None is another enlarged. All
joints of a machine turn, or all slide: errors in radians and in metres have no common size.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind import hidden
from benchmarks.blind.dynamics import mass_and_bias, reduced
from benchmarks.blind.plant import neutral
from benchmarks.blind.rig import Link, Rig
from benchmarks.blind.worlds import Bench, World, draw_bench, probe

Array = NDArray[np.float64]
SLIDING = 0.4
"""Share of linear axes where the hidden effect leaves the choice."""
RATES = (125, 250, 500, 1000, 2000)
ROWS = 12000
"""Of one trial at most: as many as of the longest usual one."""
FINGER_RANGE, FINGER_LOOP, FINGER_TORQUE = 1.05, 32.0, 0.16
"""Range [rad], natural frequency of the loop [rad/s] and peak torque [N m] of the usual finger's motion."""
PEAK = 98
"""Percentile of a torque that counts as its peak."""
FINGER_SPEED, FINGER_ACCELERATION = 3.0, 30.0
"""Peaks of the finger's commands [ranges/s, ranges/s^2]."""
CONTROLLER_RATE = 10000.0
"""At least so often the controllers compute their torque [Hz].

Steps four times as fine move the joints by less than half of the sensor floor.
"""


def log(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between the two, its logarithm uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def digits(values: Array | float) -> Array:
    """As an owner writes numbers down: four digits."""
    return np.array([float(f"{x:.4g}") for x in np.atleast_1d(values)])


def arm(rng: np.random.Generator, joints: int, coupled: bool, swings: bool) -> Rig:
    """A chain of rods with a load at its end: a micro finger, a servo's horn, a shoulder that bears 30 kg."""
    weight = log(rng, 0.015, 700.0)
    reach = 0.12 * weight**0.28 * log(rng, 0.6, 1.6)
    mass = weight / (9.81 * reach)
    count = joints + coupled
    lengths = reach * (share := rng.uniform(0.6, 1.0, count)) / share.sum()
    masses = mass * (part := np.geomspace(2.0, 1.0, count) * rng.uniform(0.7, 1.3, count)) / part.sum()
    sideways = joints > 1 and not swings and rng.uniform() < 0.3
    links: list[Link] = []
    for i in range(count):
        axis = (1, 0, 0) if sideways and i == 0 else (0, 1, 0)
        side = masses[i] * lengths[i] ** 2 / 12
        links.append(
            Link(
                f"joint_{i + 1}", axis, (0, 0, -float(lengths[i - 1]) if i else 0.0),
                (0.0, 0.0, -float(lengths[i] * rng.uniform(0.45, 0.6))), float(masses[i]),
                (float(side), float(side), float(0.1 * side)), -3.1, 3.1,
                follows=f"joint_{i}" if coupled and i == count - 1 else None,
            )
        )  # fmt: skip
    gravity = (0.0, -9.81, 0.0) if not swings and rng.uniform() < 0.15 else (0.0, 0.0, -9.81)
    if rng.uniform() < 0.3:
        tilt = rng.uniform(-0.6, 0.6)
        gravity = (9.81 * float(np.sin(tilt)), 0.0, -9.81 * float(np.cos(tilt)))
    return Rig("arm", links, gravity)


def stage(rng: np.random.Generator, joints: int) -> tuple[Rig, Array]:
    """Stacked linear axes, horizontal or upright, and their strokes [m]."""
    load, strokes = log(rng, 1.0, 100.0), np.array([log(rng, 0.1, 1.0) for _ in range(joints)])
    upright = rng.uniform() < 0.4
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1)][:joints]
    if upright:
        axes[-1] = (0, 0, 1)
    masses = load * np.cumprod(rng.uniform(1.1, 2.0, joints))[::-1] / 1.1
    if joints > 1:
        masses[:-1] -= masses[1:]
    links = []
    for i in range(joints):
        inertia = float(masses[i] * (0.2 * strokes[i]) ** 2)
        half = float(np.round(0.6 * strokes[i], 3))
        links.append(
            Link(
                "xyz"["xyz".index("z") if axes[i] == (0, 0, 1) else i] + "_axis", axes[i], (0, 0, 0), (0, 0, 0),
                float(masses[i]), (inertia,) * 3, -half, half, slides=True,
            )
        )  # fmt: skip
    return Rig("stage", links, (0.0, 0.0, -9.81)), strokes


def _loads(rig: Rig, low: Array, high: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Largest inertia and weight that each actuated joint bears within the motion."""
    select, shift = rig.selection()
    inertia, weight = np.zeros(len(low)), np.zeros(len(low))
    for _ in range(8):
        q = select @ rng.uniform(low, high) + shift
        mass, bias = mass_and_bias(*rig.arrays(), np.array(rig.gravity), q, np.zeros(len(q)))
        inverse, felt = reduced(mass, bias, select, np.zeros(len(low)))
        inertia = np.maximum(inertia, np.diag(np.linalg.inv(inverse)))
        weight = np.maximum(weight, np.abs(felt))
    return inertia, weight


def _motion(rng: np.random.Generator, rig: Rig, strokes: Array | None) -> tuple[Array, Array, float]:
    """Ends of the motion, and the least time unit at which speed and acceleration are this machine's."""
    n = len(rig.actuated)
    if strokes is not None:
        span = strokes * rng.uniform(0.4, 1.0, n)
        middle, acceleration = (strokes - span) * rng.uniform(-0.5, 0.5, n), log(rng, 2.0, 20.0)
    else:
        span, middle = rng.uniform(0.5, 2.2, n), rng.uniform(-0.6, 0.6, n)
        reach = sum(2 * abs(link.com[2]) for link in rig.links)
        acceleration = log(rng, 3.0, 30.0) / reach
    speed = log(rng, 0.6, 4.0)
    slow = max(FINGER_SPEED / speed, float(np.sqrt(FINGER_ACCELERATION * span.max() / acceleration)))
    return middle - span / 2, middle + span / 2, slow


def build(rng: np.random.Generator, rig: Rig, strokes: Array | None, amplitude: float) -> World:
    """The machine with its drives, and what its owner believes of them; commands as fast as it can follow."""
    low, high, least = _motion(rng, rig, strokes)
    middle, half = (low + high) / 2, amplitude * (high - low) / 2
    low, high = middle - half, middle + half
    n, span = len(low), high - low
    inertia, weight = _loads(rig, low, high, rng)
    gears = inertia * np.array([log(rng, 0.1, 3.0) for _ in range(n)])
    total = inertia + gears
    slow = log(rng, 3.0, 15.0) if strokes is not None else log(rng, 2.0, 8.0) * float(weight.max() + 0.01) ** -0.07
    loop = 2 * np.pi * slow * rng.uniform(0.8, 1.25, n)
    loop = np.maximum(loop, np.sqrt(weight / (0.06 * span * total)))  # sags by 6 % of the motion at most
    if strokes is not None:
        loop = np.minimum(loop, np.sqrt(1e5 / total))
    kp = digits(total * loop**2)
    stated = digits(2 * rng.uniform(0.5, 1.2, n) * np.sqrt(kp * total))
    rigid = strokes is not None and rng.uniform() < 0.35
    stiffness = np.full(n, np.inf) if rigid else digits(kp * log(rng, 4.0, 30.0))
    time = max(FINGER_LOOP / float(loop.min()) * log(rng, 1.0, 2.5), min(least, 6.0))
    off = lambda share: 1.0 + rng.uniform(-share, share, n)  # noqa: E731
    gears = digits(gears)
    plant = neutral(n)._replace(
        kp=kp, kd=stated * off(0.1), stiffness=stiffness, reflected_inertia=gears * off(0.15),
        angle_unit=span / FINGER_RANGE, speed_unit=span / FINGER_RANGE / time, time_unit=FINGER_LOOP / loop,
    )  # fmt: skip
    world = World("", rig, plant, {}, low, high, float(np.abs([low, high]).max() + span.max()), time_unit=time)
    torque = probe(world, 1)[1]
    peak = np.percentile(np.abs(torque - np.median(torque, axis=0)), PEAK, axis=0)
    friction = digits(np.minimum(peak * log(rng, 0.03, 0.25), 0.02 * kp * span))
    limit = digits((np.abs(torque).max(axis=0) + friction) * rng.uniform(1.3, 3.0))
    plant = plant._replace(static_friction=friction * off(0.25), torque_limit=limit)
    nominal = {} if rigid else {"stiffness": stiffness.tolist()}
    nominal |= {"static_friction": friction.tolist(), "reflected_inertia": gears.tolist()}
    size = f"{np.abs(torque).max():.2g} {'N m' if strokes is None else 'N'}"
    world = replace(
        world, kind=f"{n} {'turning' if strokes is None else 'sliding'}, {size}", plant=plant,
        nominal={
            "controller": {"kp": kp.tolist(), "kd": stated.tolist(), "torque_limit": limit.tolist()},
            "nominal": nominal,
        },
        torque_unit=peak / FINGER_TORQUE, torque_noise=peak * log(rng, 0.002, 0.02),
        homing=log(rng, 0.2, 1.0) if strokes is None else log(rng, 0.02, 0.3),
    )  # fmt: skip
    for i, link in enumerate(rig.actuated):
        own = next(x for x in rig.links if x.joint == link)
        own.effort, own.velocity = float(digits(2 * limit[i])[0]), float(digits(20 * span[i] / time)[0])
    return world


def _sane(world: World) -> bool:
    """Whether the loop is stable and its joints come near their commands: within a fifth of the motion (RMS)."""
    position, _, command = probe(world, 1)
    wrong = np.sqrt(((position - command) ** 2).mean(axis=0))
    return bool(np.isfinite(position).all() and (wrong < 0.2 * (world.high - world.low)).all())


def measure(rng: np.random.Generator, world: World, seconds: float | None) -> tuple[Bench, bool]:
    """A bench whose encoder and rates suit the machine, and whether its excitation is poor."""
    bench, poor = draw_bench(rng, seconds)
    span, sliding = float((world.high - world.low).min()), world.rig.links[0].slides
    fastest = FINGER_LOOP / float(world.plant.time_unit.min()) / (2 * np.pi)
    encoder = float(rng.choice([5e-7, 1e-6, 5e-6, 1e-5])) if sliding else 2 * np.pi / 2 ** int(rng.integers(14, 21))
    seconds = round(max(bench.seconds * min(world.time_unit, 2.5), 4.0), 1) if seconds is None else seconds
    fast = [r for r in RATES if r >= 25 * fastest] or [RATES[-1]]
    rate = float(rng.choice([r for r in fast if r <= 250 * fastest and r * seconds <= ROWS] or fast[:1]))
    bench = replace(
        bench, rate=rate, settle=bench.settle * world.time_unit,
        seconds=min(seconds, ROWS / rate),
        noise=span * (log(rng, 5e-6, 1e-4) if sliding else log(rng, 2e-5, 3e-4)),
        resolution=encoder,
    )  # fmt: skip
    return bench, poor


def draw_machine(
    rng: np.random.Generator, chosen: list[str], seconds: float | None, kind: str | None
) -> tuple[World, Bench, bool]:
    """A machine on which the chosen effects can act, its bench, and whether its excitation is poor.

    `kind` may force `turning` or `sliding`.
    """
    coupled = "coupling_error" in chosen
    swings = any(name in hidden.NEEDS_SWING for name in chosen)
    many = coupled or any(name in hidden.NEEDS_NEIGHBOUR for name in chosen)
    while True:
        joints = int(rng.choice([2, 3] if many else [1, 1, 2, 3]))
        sliding = kind == "sliding" if kind else not (coupled or swings) and bool(rng.uniform() < SLIDING)
        rig, strokes = stage(rng, joints) if sliding else (arm(rng, joints, coupled, swings), None)
        world = build(rng, rig, strokes, float(rng.uniform(0.7, 1.0)))
        bench, poor = measure(rng, world, seconds)
        if _sane(world):
            break
    world.step = 1.0 / (bench.rate * np.ceil(CONTROLLER_RATE / bench.rate))
    if rng.uniform() < 0.5:
        world.nominal["controller"]["rate_hz"] = round(1.0 / world.step)
    return world, bench, poor
