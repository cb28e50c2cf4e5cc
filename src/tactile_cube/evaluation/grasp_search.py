"""Search for grasps that hold the object by themselves: fingertips at random places, then simulated at full weight."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.hand.gait import places
from tactile_cube.hand.hand import Hand
from tactile_cube.hand.object_mesh import tip_centres
from tactile_cube.randomization import Grasps
from tactile_cube.simulation import EpisodeConstants, Start, World

CLEARANCE = 1e-3  # gap between fingertip and face before the hand closes [m]; as in conf/start/wide_yaw.yaml
REACHED = 1e-3
"""A place counts as reachable if the fingertip comes this near to it [m]: a tenth of how deep targets press."""
BETWEEN_TIPS = 2e-3  # least gap between the tips of two fingers before the hand closes [m]
CLOSING_TIME = 0.1
"""T_s while the hand closes [s]: targets are constant, so what stands in the end hardly depends on it."""


YAW = 0.25 * np.pi  # the object is turned by at most this about the vertical [rad]; a cube's faces repeat beyond
SWING = 0.9  # a finger stands at most this far about the vertical from its own place [rad]
PRESS, AWAY = (0.004, 0.016), (0.008, 0.03)
"""Depth of a holding finger's target under the face, gap between the face and that of a finger in the air [m]."""
IN_AIR = 0.5  # part of the tries in which one finger is in the air; needs four fingers
CLOSING, HOLDING, WATCHED = 4, 10, 5
"""Policy steps without weight in which the hand closes; at full weight; the last of them, in which nothing may move."""
CREEP, TURN = 0.001, 0.02  # how far [m] and by which angle [rad] the object may move in them
SHIFTED, TILTED = 0.012, 0.25
"""Largest distance of the object from the middle of the hand [m] and angle between its axis and the vertical [rad]."""
TOUCHING = 3  # least number of fingertips that hold it
TRIES = 100  # tries for each grasp wanted, after which the search gives up


def find_grasps(world: World, constants: EpisodeConstants, count: int, seed: int) -> Grasps:
    """Try random grasps until `count` of them held; yaws are drawn first, hard ones as often as easy ones.

    Args:
        world: simulates them, with the hand.
        constants: nominal constants; gravity acts fully.
        count: grasps to find.
        seed: of everything random.

    Raises:
        InputError: fewer than `count` were found in `TRIES` times as many tries.
    """
    if count < 1:
        raise InputError(f"grasps is {count}; give at least 1")
    rng, tries, limit = np.random.default_rng(seed), 0, TRIES * count
    rows: list[tuple[Array, ...]] = []
    yaw = rng.uniform(-YAW, YAW)
    while len(rows) < count:
        if tries >= limit:
            raise InputError(f"{len(rows)} of {count} grasps held in {limit} tries; widen the search")
        tries += 1
        attempt = _attempt(world.hand, constants, yaw, rng)
        held = attempt and _held(world, constants, *attempt, yaw)
        if held:
            rows.append(held)
            yaw = rng.uniform(-YAW, YAW)
            if len(rows) % 100 == 0:
                print(f"{len(rows)} of {count} grasps, {tries} tries")
    angles, targets, positions, quaternions = (np.stack(column) for column in zip(*rows, strict=True))
    size = tuple(np.asarray(constants.cube_size).tolist())
    origin: dict[str, str | int] = {"seed": seed, "tries": tries}
    return Grasps(angles, targets, positions, quaternions, world.hand.name, str(constants.object_shape), size, origin)


def _attempt(
    hand: Hand, constants: EpisodeConstants, yaw: float, rng: np.random.Generator
) -> tuple[Array, Array] | None:
    """Start angles and targets; None where a finger does not reach its place or two are too near."""
    four = len(hand.fingers) > TOUCHING
    lifted = int(rng.integers(len(hand.fingers))) if four and rng.random() < IN_AIR else -1
    half, turned = 0.5 * np.asarray(constants.cube_size), Rotation.from_euler("z", yaw)
    start, target, tips = np.zeros(hand.joints), np.zeros(hand.joints), []
    for finger, place in enumerate(places(hand)):
        angle = place + rng.uniform(-SWING, SWING) - yaw
        side = np.array([np.cos(angle), np.sin(angle), 0.0])
        if finger == lifted:
            gap = goal = rng.uniform(*AWAY)
        else:
            gap, goal = CLEARANCE, -rng.uniform(*PRESS)
        before, after = (
            turned.apply(tip_centres(constants.object_shape, side, half, hand.tip_radius, g)) for g in (gap, goal)
        )
        of = hand.of_finger(finger)
        first = np.clip(hand.finger_angles(finger, before), hand.action_lower[of], hand.action_upper[of])
        last = np.clip(hand.finger_angles(finger, after), hand.action_lower[of], hand.action_upper[of])
        reached = np.linalg.norm(hand.finger_tips(finger, first) - before, axis=1)
        pressed = np.linalg.norm(hand.finger_tips(finger, last) - after, axis=1)
        possible = np.flatnonzero((reached < REACHED) & (pressed < REACHED))
        if not possible.size:
            return None
        point = int(rng.choice(possible))
        start[of], target[of] = first[point], last[point]
        tips.append(before[point])
    apart = [float(np.linalg.norm(a - b)) for i, a in enumerate(tips) for b in tips[:i]]
    return None if min(apart) < 2.0 * hand.tip_radius + BETWEEN_TIPS else (start, target)


def _held(
    world: World, constants: EpisodeConstants, start: Array, target: Array, yaw: float
) -> tuple[Array, ...] | None:
    """Return the angles, targets, position and orientation in the end; None where the object is not held at rest."""
    quaternion = Rotation.from_euler("z", yaw).as_quat()
    settings = {"filter_time": CLOSING_TIME, "gravity_scale": 1.0, "gravity_onset": CLOSING}
    world.reset(replace(constants, **settings), Start(start, cube_quaternion=quaternion))  # type: ignore[arg-type]
    poses = []
    for _ in range(CLOSING + HOLDING):
        world.step(target)
        poses.append(np.concatenate([world.cube_position, world.cube_quaternion]))
        if not world.healthy or np.linalg.norm(world.cube_position) > 2.0 * SHIFTED:
            return None
    before, after = poses[-1 - WATCHED], poses[-1]
    turned = (Rotation.from_quat(before[3:]).inv() * Rotation.from_quat(after[3:])).magnitude()
    tilt = np.arccos(np.clip(Rotation.from_quat(after[3:]).as_matrix()[2, 2], -1.0, 1.0))
    still = np.linalg.norm(after[:3] - before[:3]) < CREEP and turned < TURN
    central = np.linalg.norm(after[:3]) < SHIFTED and tilt < TILTED
    pressing = [contact for contact in world.contacts() if contact.force > 0.0]
    tips = {finger.name: finger.links[-1] for finger in world.hand.fingers}
    tips_only = all(one.other == "cube" and one.link == tips[one.finger] for one in pressing)
    if not (still and central and tips_only and len({one.finger for one in pressing}) >= TOUCHING):
        return None
    return np.array(world.q), target, after[:3], after[3:]
