"""What a recording cannot show, whether the machine has it or not."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.drivetrain.effects.scales import Scales
from tactile_cube.measurement.replay.model import effect_path


class Unseen(NamedTuple):
    """An effect that a joint may have unseen.

    Attributes:
        effect: its name.
        joint: where.
        why: what the recording lacks.
    """

    effect: str
    joint: str
    why: str


def unseen(effects: Sequence[type[Effect]], sizes: Mapping[str, Scales], named: Collection[str]) -> tuple[Unseen, ...]:
    """Effects that no trial of a recording could show.

    Args:
        effects: the catalogue.
        sizes: joint -> its sizes in the recording.
        named: effects that were seen all the same, NAME@JOINT.
    """
    found = (
        Unseen(effect_path(e), joint, why) for e in effects for joint, s in sizes.items() if (why := e.unseen_at(s))
    )
    return tuple(one for one in found if f"{one.effect}@{one.joint}" not in named)
