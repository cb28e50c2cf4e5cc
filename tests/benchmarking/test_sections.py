"""Every section measures something, in little."""

from functools import partial

import pytest

from tactile_cube.benchmarking.accuracy import accuracy
from tactile_cube.benchmarking.collector import collector
from tactile_cube.benchmarking.end_to_end import end_to_end
from tactile_cube.benchmarking.environment import environment
from tactile_cube.benchmarking.identification import identification
from tactile_cube.benchmarking.report import Section
from tactile_cube.benchmarking.sections import SECTIONS, check_sections
from tactile_cube.benchmarking.startup import startup
from tactile_cube.benchmarking.update import update
from tactile_cube.errors import InputError
from tactile_cube.simulation import SimulationOptions

SMALL = {
    "environment": partial(environment, 1, peers=False, calls=1),
    "accuracy": partial(accuracy, {"fast": SimulationOptions.fast()}, SimulationOptions(solver_iterations=60)),
    "update": partial(update, 1, peers=False, calls=1, hidden=16),
    "collector": partial(collector, 1, worlds=(1, 2), processes=(1,), steps=2),
    "end_to_end": partial(end_to_end, 1, peers=False, worlds=2, steps=3, updates=1, hidden=16),
    "identification": partial(identification, 1, peers=False, duration=2.0, kinds=2, session=2.0, hidden=[()]),
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


def test_every_section_of_the_verb_is_tried_here() -> None:
    assert set(SMALL) == set(SECTIONS)


def test_an_unknown_section_is_refused_with_the_choices() -> None:
    with pytest.raises(InputError, match=r"sections=speed: no such section; choose among environment, accuracy"):
        check_sections(["update", "speed"])
