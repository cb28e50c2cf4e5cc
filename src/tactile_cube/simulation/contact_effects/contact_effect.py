"""A property of fingertips or object that is a constant of the episode."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.errors import InputError
from tactile_cube.simulation.constants import EpisodeConstants


class ContactEffect:
    """A contact effect; a subclass states data only.

    Attributes:
        name: its key in configurations and model files.
        parameters: its numbers; their neutral values are the constants of the paper, bit for bit.
        constant: the field of EpisodeConstants that it changes.
        added: whether its values are added to the constant; otherwise they replace it.
        shown_by: kinds of trial that are used to identify it; other kinds where a recording has none of these.
        shows_in: how it is identified: "slips" (when something slips, each number alone), "load" (how far the fingers
            give way, all numbers together), "offsets" (joint offsets that a grip would need, the same in all
            initialisations).
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    constant: ClassVar[str]
    added: ClassVar[bool] = False
    shown_by: ClassVar[tuple[str, ...]] = ("hold",)
    shows_in: ClassVar[Literal["slips", "load", "offsets"]] = "slips"

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """Return the constants with this effect; parameters that `values` leaves out are neutral.

        Raises:
            InputError: an unknown parameter.
        """
        known = {one.name: one.neutral for one in cls.parameters}
        for key in values:
            if key not in known:
                raise InputError(f"effect {cls.name}: no parameter '{key}'; it has {', '.join(known)}")
        numbers: Any = [values.get(key, neutral) for key, neutral in known.items()]
        change = np.array(numbers) if len(numbers) > 1 else numbers[0]
        if cls.added and not np.any(change):
            return constants
        stated = getattr(constants, cls.constant)
        changed: dict[str, Any] = {cls.constant: stated + change if cls.added else change}
        return dataclasses.replace(constants, **changed)
