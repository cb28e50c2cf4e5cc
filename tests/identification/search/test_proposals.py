"""What is refitted: laws with all that they can say, and simpler laws beside one that follows any trial."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.search.explanation import Proposal, named_by
from tactile_cube.identification.search.findings import find
from tactile_cube.identification.search.proposals import grown, look, near, stepped, whole
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.split import held_out_split
from tests.identification.rigs_of_any_size import NOISE, Size, simulated


def searched(folder: Path, values: dict[str, float], names: tuple[str, ...] = ("mount_tilt",)) -> Search:
    """A search that knows these effects, of which the first one is hidden with `values`, and a table of torques."""
    recording = simulated(folder, Size(), find_effect(names[0]), values)
    effects = tuple(find_effect(name) for name in (*names, "position_torque"))
    return Search(*held_out_split(recording), np.full(1, NOISE), effects, lambda line: None)


def test_a_mount_tilted_about_both_axes_is_no_table_of_torques(tmp_path: Path) -> None:
    verdict = decide(find(searched(tmp_path, {"first": 0.1, "second": 0.3})))
    assert named_by(verdict.chosen.effects) == {("mount_tilt", "a")}
    assert verdict.chosen.error == pytest.approx(1.0, abs=0.05)


def test_a_simpler_law_is_refitted_beside_a_table_at_the_noise_floor(tmp_path: Path) -> None:
    search = searched(tmp_path, {"first": 0.2})
    looks = look(search, Proposal((), search.base.fit), ["a"])
    table = next(law for law in looks.tried if law[0].effect.name == "position_torque")
    tilt = next(candidate for candidate, _ in looks.tried if candidate.effect.name == "mount_tilt")
    unmoved = stepped(looks.problem, looks.frozen, tilt, 0)
    found = grown(search, replace(looks, tried=[table, unmoved]))
    (alone,) = (one for one in found if named_by(one.effects) == {("position_torque", "a")} and whole(search, [one]))
    assert not near(looks, unmoved[1].cost, [alone])
    assert {("mount_tilt", "a")} in [named_by(one.effects) for one in found if whole(search, [one])]


def test_a_table_that_is_worse_is_tried_as_the_spring_that_it_contains(tmp_path: Path) -> None:
    verdict = decide(find(searched(tmp_path, {"error": -0.1}, ("torque_gain", "payload"))))
    assert named_by(verdict.chosen.effects) == {("torque_gain", "a")}
    names = {frozenset(one.effects[-1].form) for one in verdict.rivals}
    assert names == {frozenset({"mass", "distance"}), frozenset({"stiffness", "bias"})}
