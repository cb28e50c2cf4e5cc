"""What a policy was trained with, from what its file says: hand, object, constants, task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.randomization import StartStates
from tactile_cube.simulation import EpisodeConstants, constants_of

MAKERS = ("tactile_cube.hand.hand_from_urdf", "tactile_cube.hand.published_hand")
"""What a policy file may name: nothing else is made from it."""


@dataclass(frozen=True)
class TrainingSetting:
    """What a robot's loop takes over from the training.

    Attributes:
        hand: its start angles are those around the object.
        constants: of an episode, without what randomisation varied: gains, torque limit, object, table. The object
            weighs in full, wherever the curriculum stood: on a robot it does.
        task: which way to turn the object, and about which axis.
    """

    hand: Hand
    constants: EpisodeConstants
    task: Task

    @classmethod
    def of(cls, hand: Hand, constants: EpisodeConstants | None = None, task: Task | None = None) -> TrainingSetting:
        """The setting of a hand, by default around the nominal cube, in the air."""
        known, task = constants or constants_of(hand), task or Task("full")
        angles = StartStates().of(hand, known).angles[0]
        weighs = task.apply(known, replace(task.conditions(), gravity_scale=1.0))
        return cls(replace(hand, start_angles=angles), weighs, task)


def training_setting(info: Mapping[str, Any], hand: Hand | None = None) -> TrainingSetting:
    """Return what a policy was trained with.

    Args:
        info: what the policy file says beside its weights.
        hand: the one that the file names, from elsewhere: its URDF may have moved.

    Raises:
        InputError: the file names another hand, something else than a hand of this package, what no constant or task
            has, or a URDF that is no longer there.
    """
    env = (info.get("config") or {}).get("env") or {}
    trained = (env.get("hand") or {}).get("name", DLR_HAND2.name)
    if hand is not None and hand.name != trained:
        raise InputError(
            f"hand={hand.name}: the policy was trained on {trained}; give policy=FILE of this hand, or motion=holds "
            "to move it without one"
        )
    hand = hand or _hand(env.get("hand"))
    given = _values(env, "constants", {"object", *(field.name for field in fields(EpisodeConstants))})
    task = _values(env, "task", {field.name for field in fields(Task)})
    return TrainingSetting.of(hand, constants_of(hand, **given), Task(**task) if task else None)


def _hand(named: Mapping[str, Any] | None) -> Hand:
    from hydra.utils import instantiate

    if named is None:
        return DLR_HAND2
    if named.get("_target_") not in MAKERS:
        raise InputError(f"the policy names the hand {named.get('_target_')!r}; only {' and '.join(MAKERS)} are made")
    hand: Hand = instantiate(dict(named), _convert_="all")
    return hand


def _values(env: Mapping[str, Any], part: str, known: set[str]) -> dict[str, Any]:
    """The plain values of a part of the environment; classes and the hand stand elsewhere."""
    values = {key: value for key, value in (env.get(part) or {}).items() if key not in ("_target_", "hand", "joints")}
    for key in values.keys() - known:
        raise InputError(f"the policy's file has env.{part}.{key}, which this version does not know")
    return values
