"""Every section measures something, in little."""

from functools import partial

import pytest

from benchmarks.speed.__main__ import SECTIONS
from benchmarks.speed.accuracy import accuracy
from benchmarks.speed.end_to_end import end_to_end
from benchmarks.speed.environment import environment
from benchmarks.speed.identification import identification
from benchmarks.speed.report import Section
from benchmarks.speed.startup import startup
from benchmarks.speed.update import update
from tactile_cube.simulation import SimulationOptions

ONE_JOINT = {"joints": ["q2"], "kinds": ("ramps", "multisine"), "initialisations": 2}
SMALL = {
    "environment": partial(environment, 1, peers=False, calls=1),
    "accuracy": partial(accuracy, {"fast": SimulationOptions()}, SimulationOptions(solver_iterations=60)),
    "update": partial(update, 1, peers=False, calls=1, hidden=16),
    "end_to_end": partial(end_to_end, 1, peers=False, worlds=2, steps=3, updates=1, hidden=16),
    "identification": partial(
        identification, 1, peers=False, duration=1.0, kinds=1, session=2.0, hidden=[], bench=ONE_JOINT
    ),
    "startup": partial(startup, 1, commands=("--help",), trains=False),
}


@pytest.mark.parametrize("name", SMALL)
def test_a_section_gives_positive_figures_with_quartiles_in_order(name: str) -> None:
    section: Section = SMALL[name]()
    assert section.name == name
    assert section.figures
    for figure in section.figures:
        assert 0.0 < figure.low <= figure.value <= figure.high
    for growth in section.growth:
        assert len(growth.x) == len(growth.y) > 0
        assert min(growth.y) > 0.0


def test_every_section_is_tried_here() -> None:
    assert set(SMALL) == set(SECTIONS)
