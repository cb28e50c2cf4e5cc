from pathlib import Path

import numpy as np

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.search.findings import twins
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated


def test_another_law_that_does_as_well_is_found_whichever_came_first(tmp_path: Path) -> None:
    """A slide that carries more is one that is pushed less."""
    effects = tuple(find_effect(name) for name in ("payload", "torque_gain", "command_delay"))
    recording = simulated(tmp_path, Size(slides=True), effects[0], {"mass": 0.1, "distance": 0.03})
    fitted, held_out = held_out_split(recording)
    search = Search(fitted, held_out, np.full(1, NOISE), effects, lambda line: None)
    frozen = search.frozen(search.base.fit)
    gain = next(one for one in search.candidates if one.effect.name == "torque_gain")
    chosen = search.finish(search.base, *search.refit(frozen, gain), 1)
    assert {one.effects[0].effect.name for one in twins(search, chosen, search.base, [chosen])} == {"payload"}
    assert twins(search, chosen, search.base, [chosen, *twins(search, chosen, search.base, [chosen])]) == []
