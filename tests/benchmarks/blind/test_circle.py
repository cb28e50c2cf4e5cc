"""The blind circle's hand is the package's own, but for what is hidden in it; its table counts what it says."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.blind import circle, excitation
from benchmarks.blind.generator import perform, save
from tactile_cube.drivetrain.effects import parse_effect
from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.rigid_body import Mimic, RigidBodyTree
from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.model import nominal_model, terms_of
from tactile_cube.measurement.replay.simulator import free_run

QUIET = replace(circle.BENCH, seconds=2.0, initialisations=1, kinds=("multisine",), noise=1e-9, resolution=1e-9)


def test_the_finger_has_the_masses_of_the_hand() -> None:
    ours, theirs = (
        RigidBodyTree.from_urdf(urdf, ("q1", "q2", "q3"), {"q4": Mimic("q3", 1.0, 0.0)})
        for urdf in (circle.finger().urdf(), DLR_HAND2.finger_urdf(0))
    )
    for angles in np.random.default_rng(0).uniform(-0.1, 1.0, (3, 3)):
        matrices = [one.actuated_mass_matrix(angles) for one in (ours, theirs)]
        assert matrices[0] == pytest.approx(matrices[1], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", ["torque_bias", "torque_gain", "coulomb_friction", "command_delay"])
def test_what_is_hidden_on_the_bench_is_what_the_hand_has(tmp_path: Path, name: str) -> None:
    key, mild, grave, _, put = circle.EFFECTS[name]
    size, plant = 0.5 * (mild + grave), circle.healthy()
    put(plant, 1, size)
    world = circle.measured(plant)
    world.homing = 0.0
    save(tmp_path, world, QUIET, perform(3, world, QUIET)[0])
    recording = read_recording(tmp_path)
    plain = nominal_model(recording)
    hidden = replace(plain, terms=tuple(terms_of([parse_effect(f"{name}@q2: {key}={size}")], recording.joints)))
    without, beside = (free_run_error(recording, free_run(recording, m, step=1e-3)).overall for m in (plain, hidden))
    assert beside < 2e-3 < 4e-3 < without


def test_steps_without_any_filter_are_followed_as_well_as_gentle_motion(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(excitation.COMMANDS, "sudden", lambda *args: excitation._stepped(*args[:4], 0.5, args[4]))
    world = circle.measured(circle.healthy())
    world.homing = 0.0
    bench = replace(QUIET, kinds=("sudden",))
    save(tmp_path, world, bench, perform(3, world, bench)[0])
    recording = read_recording(tmp_path)
    torque = np.abs(np.concatenate([trial.torque for trial in recording.trials if trial.torque is not None]))
    assert torque.max() > 0.99 * circle.STATED["torque_limit"]
    coarse, fine = (
        free_run_error(recording, free_run(recording, nominal_model(recording), step=step)).overall
        for step in (2e-3, 2.5e-4)
    )
    assert coarse < 1e-3
    assert fine < 1e-4


def test_a_draw_is_the_same_each_time_and_its_effects_grow_before_others_are_tried() -> None:
    assert circle.draw(7, 0)["words"] == circle.draw(7, 0)["words"]
    for seed in range(20):
        hands = [circle.draw(seed, attempt) for attempt in range(2 * circle.SIZES)]
        assert len({tuple(hand[key] for key in circle.CONTACT) for hand in hands}) == 1
        first, second = (hands[at : at + circle.SIZES] for at in (0, circle.SIZES))
        for one in (first, second):
            assert len({tuple((e["name"], *e["joints"]) for e in hand["effects"]) for hand in one}) == 1
            for effect in range(len(one[0]["effects"])):
                name, sizes = one[0]["effects"][effect]["name"], []
                for hand in one:
                    sizes += [abs(size) for size in hand["effects"][effect]["parameters"].values()]
                assert sizes == sorted(sizes, reverse=name == "torque_saturation")
    assert circle.draw(7, 0)["words"] != circle.draw(7, circle.SIZES)["words"]


def test_the_table_counts_what_was_lost_and_what_came_back() -> None:
    def of(successes: int) -> dict[str, Any]:
        return {"successes": successes, "episodes": 10, "kept": 9, "mean_angle": 12.34}

    line = {
        "commit": "abc",
        "tip_friction": 0.9,
        "tip_spinning_friction": 3e-3,
        "tip_compliance": 2e-4,
        "words": ["torque_bias@q2: bias=0.2"],
    }
    line |= {"verdict": "missing_effect", "named": ["torque_bias@q2"], "judged": "right", "plain": of(10)}
    lines = [
        line | {"seed": 2, "before": of(5), "after": of(8), "control": of(7)},
        line | {"seed": 1, "before": of(0), "control": of(0), "verdict": "adequate", "named": []},
        line | {"seed": 3, "before": of(6), "after": of(10), "control": of(10)},
    ]
    text = circle.page(lines, "python -m benchmarks.blind.circle")
    assert "lost (at most 5 of 10) on 2 of 3 hands, and came back (at least 8) on 1 of them with the model" in text
    assert "on 0 without." in text
    row = "| 2 | 0.9, 3.0, 0.20 | torque_bias@q2: bias=0.2 | `missing_effect`: torque_bias@q2 | right | 10 of 10, "
    assert row in text
    assert "`adequate`: nothing named" in text
