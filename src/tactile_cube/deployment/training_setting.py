"""Training setting of a policy, read from its file: hand, object, constants, task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from hydra.utils import instantiate

from tactile_cube.agent.policy_parts import making, require_parts
from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.kinematics import tip_positions
from tactile_cube.hand.object_mesh import tip_centres
from tactile_cube.randomization import StartStates
from tactile_cube.simulation import EpisodeConstants, constants_of

DRIVES = {"kp": (0.5, 2.0), "kd": (0.5, 2.0), "torque_limit": (0.0, 1.0)}
"""Allowed range of a training's gains and torque limit, as multiples of the hand's own."""
MISS = 0.01  # largest distance of a fingertip from its place at the object [m]; beyond, the object is out of reach
CONSTANTS = {"object", *(field.name for field in fields(EpisodeConstants))}


@dataclass(frozen=True)
class TrainingSetting:
    """What a robot's loop takes over from the training: the hand, with start angles around the object, and the task.

    The constants are without what randomisation varied; the object weighs in full, wherever the curriculum stood.
    """

    hand: Hand
    constants: EpisodeConstants
    task: Task

    @classmethod
    def of(cls, hand: Hand, constants: EpisodeConstants | None = None, task: Task | None = None) -> TrainingSetting:
        """Return the setting of a hand, by default around the nominal cube, in the air."""
        known, task = constants or constants_of(hand), task or Task("full")
        angles = StartStates().of(hand, known).angles[0]
        weighs = task.apply(known, replace(task.conditions(), gravity_scale=1.0))
        return cls(replace(hand, start_angles=angles), weighs, task)


def training_setting(
    info: Mapping[str, Any],
    hand: Hand | None = None,
    object: Mapping[str, Any] | None = None,
    label: str = "the policy",
) -> TrainingSetting:
    """Return the training setting of a policy from the metadata of its file.

    `hand` and `object` are those that the file names, where their files are none of the package's: no file has another
    file read. Messages call the policy `label`.

    Raises:
        InputError: another hand or another URDF than the file names, or a file of which no setting can be made; see
            `require_parts`.
    """
    named = {"hand": hand, "object": object}
    env = require_parts((info.get("config") or {}).get("env") or {}, label, [key for key in named if named[key]])
    if hand is not None:
        _require_trained(hand, info["config"]["env"].get("hand") or {})
    with making(label):
        if hand is None:
            hand = instantiate(env["hand"], _convert_="all") if env.get("hand") is not None else DLR_HAND2
        constants = {"object": object} | _values(env, "constants", CONSTANTS, label)
        task = _values(env, "task", {field.name for field in fields(Task)}, label)
        made = constants_of(hand, **constants)
        _require_drives(made, constants_of(hand), label)
        setting = TrainingSetting.of(hand, made, Task(**task) if task else None)
    _require_reach(setting, label)
    return setting


def _require_trained(hand: Hand, named: Mapping[str, Any]) -> None:
    trained, urdf = named.get("name", DLR_HAND2.name), named.get("sha256")
    if hand.name != trained:
        raise InputError(
            f"hand={hand.name}: the policy was trained on {trained}; give policy=FILE of this hand, or motion=holds "
            "to move it without one"
        )
    if urdf not in (None, hand.urdf_sha256):
        raise InputError(
            f"hand={hand.name}: its URDF has the SHA-256 {hand.urdf_sha256[:12]}..., the policy was trained on "
            f"{str(urdf)[:12]}...; give the URDF of the training"
        )


def _require_drives(trained: EpisodeConstants, own: EpisodeConstants, label: str) -> None:
    """Refuse gains and torques of other drives than the hand's: by them the commands to a robot are limited."""
    for key, (least, most) in DRIVES.items():
        stated, known = np.asarray(getattr(trained, key)), np.asarray(getattr(own, key))
        if not np.all((least * known <= stated) & (stated <= most * known)):
            raise InputError(
                f"{label}: env.constants.{key} is {stated.max():g}, the hand's is {known.max():g}; describe a hand "
                "with such drives and name it: hand=..."
            )


def _require_reach(setting: TrainingSetting, label: str) -> None:
    """Refuse an object around which the fingers cannot stand: by its size the start angles are chosen."""
    hand, size = setting.hand, np.asarray(setting.constants.cube_size)
    tips = tip_positions(hand, np.asarray(hand.start_angles))
    for finger, tip in zip(hand.fingers, tips, strict=True):
        wanted = tip_centres(setting.constants.object_shape, finger.face, 0.5 * size, hand.tip_radius, 1e-3)
        off = float(np.linalg.norm(wanted - tip, axis=1).min())
        if not off <= MISS:
            raise InputError(
                f"{label}: the object is {' x '.join(f'{edge:g}' for edge in size)} m; {finger.name} would start "
                f"{1e3 * off:.0f} mm off its side, allowed {1e3 * MISS:.0f} mm; give an object within the hand's reach"
            )


def _values(env: Mapping[str, Any], part: str, known: set[str], label: str) -> dict[str, Any]:
    values = {key: value for key, value in (env.get(part) or {}).items() if key not in ("_target_", "hand", "joints")}
    for key in values.keys() - known:
        raise InputError(f"{label}: has env.{part}.{key}, which this version does not know")
    return values
