"""Section: policy steps a second of one world on one core, the cube in the fingers."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.speed.held_cube import Holding, creep, motion, our_world
from benchmarks.speed.mujoco_hand import MujocoHand
from benchmarks.speed.naive_pybullet import NaivePyBullet
from benchmarks.speed.peers import find_peer
from benchmarks.speed.report import Section, rates
from benchmarks.speed.timing import in_turns
from tactile_cube.simulation import EpisodeConstants, SimulationOptions

YARDSTICK = "PyBullet, one body, a call a joint"
EFFECTS = ("viscous_friction", "stribeck_friction", "backlash")
CALLS = 10


def environment(rounds: int, peers: bool = True, calls: int = CALLS) -> Section:
    """Worlds that hold and turn the cube, and how far the held cube creeps, which says how exact the contact is.

    Args:
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
        calls: policy steps a sample.
    """
    title = "one world, cube held at full weight, 50 physics steps a policy step; note: creep of the held cube in 5 s"
    section = Section("environment", title, YARDSTICK)
    worlds = _worlds(peers, section.missing)
    try:
        _measure(section, worlds, rounds, calls)
    finally:
        for world in worlds.values():
            world.close()
    return section


def _measure(section: Section, worlds: dict[str, Holding], rounds: int, calls: int) -> None:
    notes = {name: f"creep {creep(world) * 1e3:.2f} mm" for name, world in worlds.items()}
    timings = in_turns({name: _stepping(world) for name, world in worlds.items()}, rounds, calls)
    section.figures = rates(timings, YARDSTICK, "steps/s", notes)


def _worlds(peers: bool, missing: list[str]) -> dict[str, Holding]:
    fast = SimulationOptions()
    worlds: dict[str, Holding] = {
        "tactile_cube": our_world(fast),
        "tactile_cube, 3 effects on each joint": our_world(fast, EFFECTS),
        "tactile_cube, faithful": our_world(SimulationOptions.faithful()),
        "tactile_cube, engine=mujoco": our_world(SimulationOptions("mujoco")),
        "tactile_cube, engine=mujoco, faithful": our_world(SimulationOptions.faithful("mujoco")),
    }
    if not peers:
        return worlds
    constants = EpisodeConstants()
    worlds[YARDSTICK] = NaivePyBullet(constants)
    mujoco = find_peer("mujoco", missing)
    if mujoco is not None:
        worlds["MuJoCo, impratio 10"] = MujocoHand(mujoco, constants, impratio=10.0, noslip=0)
        worlds["MuJoCo, noslip 5"] = MujocoHand(mujoco, constants, impratio=1.0, noslip=5)
    return worlds


def _stepping(world: Holding) -> Callable[[], None]:
    moving = motion()
    return lambda: world.step(next(moving))
