"""The hand that a policy was trained on, from what its file says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand

MAKERS = ("tactile_cube.hand.hand_from_urdf", "tactile_cube.hand.published_hand")
"""What a policy file may name: nothing else is made from it."""


def trained_hand(info: Mapping[str, Any]) -> Hand:
    """Return the hand of a policy.

    Args:
        info: what the policy file says beside its weights.

    Raises:
        InputError: the file names something else than a hand of this package, or the URDF is no longer there.
    """
    from hydra.utils import instantiate

    named = ((info.get("config") or {}).get("env") or {}).get("hand")
    if named is None:
        return DLR_HAND2
    if named.get("_target_") not in MAKERS:
        raise InputError(f"the policy names the hand {named.get('_target_')!r}; only {' and '.join(MAKERS)} are made")
    hand: Hand = instantiate(dict(named), _convert_="all")
    return hand
