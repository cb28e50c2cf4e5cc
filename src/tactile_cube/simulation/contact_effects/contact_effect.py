"""One property of fingertips or object that the PyBullet world knows as a constant of the episode."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.errors import InputError
from tactile_cube.simulation.constants import EpisodeConstants


class ContactEffect:
    """A contact effect; a subclass is data alone.

    Attributes:
        name: its key in configurations and model files.
        parameters: its numbers; at their neutral values it changes nothing in the world of the paper, bit for bit.
        constant: the field of EpisodeConstants that it changes.
        added: its values are added to what is stated of the object; otherwise they replace the constant.
        shown_by: the kinds of trial that show it best; others are used where a recording has none of these.
        shows_in: how: "slips" (when something slips, each number by itself), "load" (how far the fingers give way, all
            its numbers together), "offsets" (the joint offsets that a grip would need, alike in all initialisations).
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    constant: ClassVar[str]
    added: ClassVar[bool] = False
    shown_by: ClassVar[tuple[str, ...]] = ("hold",)
    shows_in: ClassVar[Literal["slips", "load", "offsets"]] = "slips"

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """The constants with this effect at some values, parameter -> number; what is left out is neutral.

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
