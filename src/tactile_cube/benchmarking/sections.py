"""The sections by name, in the order in which they are run."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Sequence

from tactile_cube.benchmarking.report import Section
from tactile_cube.errors import InputError

SECTIONS: dict[str, Callable[[int, bool], Section]] = {
    "environment": lambda rounds, peers: _function("environment")(rounds, peers),
    "accuracy": lambda rounds, peers: _function("accuracy")(),
    "update": lambda rounds, peers: _function("update")(rounds, peers),
    "collector": lambda rounds, peers: _function("collector")(rounds),
    "end_to_end": lambda rounds, peers: _function("end_to_end")(min(rounds, 5), peers),
    "identification": lambda rounds, peers: _function("identification")(rounds, peers),
    "startup": lambda rounds, peers: _function("startup")(rounds),
}


def check_sections(names: Sequence[str]) -> None:
    """Raises InputError for a name that is no section."""
    for name in names:
        if name not in SECTIONS:
            raise InputError(f"sections={name}: no such section; choose among {', '.join(SECTIONS)}")


def measure(name: str, rounds: int, peers: bool) -> Section:
    """Run one section.

    Args:
        name: of the section.
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
    """
    began = time.perf_counter()
    section = SECTIONS[name](rounds, peers)
    section.seconds = time.perf_counter() - began
    return section


def _function(name: str) -> Callable[..., Section]:
    """Sections are imported when they are run: one that was not asked for shall not cost a second."""
    found: Callable[..., Section] = getattr(importlib.import_module(f"tactile_cube.benchmarking.{name}"), name)
    return found
