"""The catalogue of physical effects in words: for the terminal, for a program and for docs/effects.md."""

import inspect
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from tactile_cube.composition import suggestion
from tactile_cube.drivetrain.effects import Effect, Parameter, catalogue
from tactile_cube.errors import InputError
from tactile_cube.simulation.contact_effects import contact_catalogue

NOTE = re.compile(r"^(In data|Confused with|Source): ", re.MULTILINE)
COLUMNS = ("parameter", "unit", "neutral", "typical", "range searched", "source")


@dataclass(frozen=True)
class EffectDescription:
    """An effect of the catalogue in words.

    Attributes:
        name: as it is written in `effects=[NAME@JOINT]`; effects of the contact have no joint.
        acts_on: the signal or the part of the machine that it changes.
        summary: one line.
        law: its formula and what its parameters mean.
        notes: "In data", "Confused with", "Source" and "Special cases" -> what its class says about it.
        parameters: its numbers, stated for a finger's joint.
    """

    name: str
    acts_on: str
    summary: str
    law: str
    notes: dict[str, str]
    parameters: tuple[Parameter, ...]

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """A row of COLUMNS for each parameter; numbered ones that are alike share a row."""
        alike = groupby(self.parameters, lambda p: (re.sub(r"\d+$", "", p.name), p.unit, p.low, p.high))
        return [_row(list(group)) for _, group in alike]

    @property
    def text(self) -> str:
        """Everything about the effect, for the terminal."""
        head = f"{self.name} (acts on: {self.acts_on})\n{self.summary}"
        notes = "\n".join(f"{title}: {note}" for title, note in self.notes.items())
        return "\n\n".join([head, self.law, "\n".join(_aligned([COLUMNS, *self.rows])), notes])


def effects(name: str | None = None) -> tuple[EffectDescription, ...]:
    """Describe the effects that `diagnose` searches and `identify` fits.

    Args:
        name: one of them; None: all, first those of the drivetrain in the order in which they act.

    Raises:
        InputError: there is no such effect.

    Example:
        >>> for effect in tactile_cube.effects():
        ...     print(effect.name, effect.summary)
        >>> print(tactile_cube.effects("stribeck_friction")[0].text)
    """
    known: dict[str, type[Effect]] = {**catalogue(), **contact_catalogue()}
    if name is None:
        return tuple(_described(kind) for kind in known.values())
    if name not in known:
        raise InputError(
            f"effect '{name}' is unknown{suggestion(name, known) or f'; choose one of {chr(44).join(known)}'}"
        )
    return (_described(known[name]),)


def effects_table(descriptions: Sequence[EffectDescription]) -> str:
    """Return a few lines on each effect: its summary, and the range of each parameter."""
    lines = []
    for one in descriptions:
        rows = [(name, reach if unit == "1" else f"{reach} {unit}") for name, unit, _, _, reach, _ in one.rows]
        lines += [f"{one.name}: {one.summary}", *(f"    {line}" for line in _aligned(rows))]
    return "\n".join([*lines, "", "name=EFFECT shows one in detail: its law, what it looks like in data, its source."])


def _described(kind: type[Effect]) -> EffectDescription:
    about, *parts = NOTE.split(inspect.getdoc(kind) or "")
    summary, _, law = about.strip().partition("\n\n")
    notes = dict(zip(parts[::2], (" ".join(note.split()) for note in parts[1::2]), strict=True))
    if kind.contains:
        notes["Special cases"] = ", ".join(f"`{name}`" for name in kind.contains)
    acts_on = kind.stage.name.lower().replace("_", " ")
    return EffectDescription(kind.name, acts_on, " ".join(summary.split()), law, notes, kind.parameters)


def _row(alike: Sequence[Parameter]) -> tuple[str, ...]:
    first, last = alike[0], alike[-1]
    name = first.name if first is last else f"{first.name} to {last.name}"
    reach = f"{_number(first.low)} to {_number(first.high)}"
    return name, first.unit, _number(first.neutral), _number(first.typical), reach, first.source


def _number(value: float) -> str:
    return f"{value:g}" if abs(value) < 1e9 else "-inf" if value < 0.0 else "inf"


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
