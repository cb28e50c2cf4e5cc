"""The field's standard model: what it recovers from noisy readings, what fixes its scale, and what it refuses."""

from dataclasses import replace
from math import copysign, sin
from pathlib import Path

import numpy as np
import polars
import pytest
import yaml
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.search.evidence import HeldOut
from tactile_cube.identification.search.explanation import named_by
from tactile_cube.identification.search.findings import find
from tactile_cube.identification.search.search import Search
from tactile_cube.identification.standard_model import StandardModel, fit_standard_model, soft_l1
from tactile_cube.identification.verdict import decide
from tactile_cube.measurement.comparing.noise_floor import noise_with_links, reading_step
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import nominal_model
from tactile_cube.measurement.split import held_out_split

Array = NDArray[np.float64]
MASS, LEVER, INERTIA = 0.5, 0.2, 0.002  # [kg], [m], [kg m^2] about the centre
GAIN, VISCOUS, DRY = 0.8, 0.01, 0.02  # of the commanded torque, [N m s/rad], [N m]
STEP, FINE, ROWS = 0.004, 20, 1000
NOISE = 2e-4  # [rad]
URDF = f"""<robot name="pendulum"><link name="base"/><link name="rod"><inertial><origin xyz="0 0 {-LEVER}"/>
<mass value="{MASS}"/><inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}"
  ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-7" upper="7" effort="5" velocity="50"/></joint></robot>"""


def swing(start: float, torque: Array) -> Array:
    """Position (rows,) [rad] of a pendulum let go at rest, whose drive gives less than it is asked for."""
    inertia, dt = INERTIA + MASS * LEVER**2, STEP / FINE
    position, speed, log = start, 0.0, np.zeros(len(torque))
    for row, asked in enumerate(torque.tolist()):
        log[row] = position
        for _ in range(FINE):
            pulled = GAIN * asked - VISCOUS * speed - 9.81 * MASS * LEVER * sin(position)
            free = speed + dt * pulled / inertia
            speed = copysign(max(abs(free) - dt * DRY / inertia, 0.0), free)
            position += dt * speed
    return log


def recorded(folder: Path, trials: dict[str, tuple[float, Array]]) -> Recording:
    rng = np.random.default_rng(0)
    (folder / "rig.urdf").write_text(URDF)
    for name, (start, torque) in trials.items():
        position = swing(start, torque) + NOISE * rng.standard_normal(len(torque))
        columns = {"time": STEP * np.arange(len(torque)), "hinge.command": torque, "hinge.position": position}
        polars.DataFrame(columns).write_parquet(folder / f"{name}.parquet")
    description = {
        "format": 1, "gravity": [0.0, 0.0, -9.81], "rate_hz": 1.0 / STEP, "joints": ["hinge"],
        "controller": {"mode": "torque"}, "sensors": {"read": "before"},
        "trials": [{"file": f"{name}.parquet", "initialisation": 0, "kind": "any"} for name in trials],
    }  # fmt: skip
    (folder / "recording.yaml").write_text(yaml.safe_dump(description))
    return read_recording(folder)


TIME = STEP * np.arange(ROWS)
STILL = np.zeros(ROWS)
SWINGS = {f"swing_{k}": (start, STILL) for k, start in enumerate((1.0, -1.4, 0.7))}
SINES = {f"sine_{k}": (0.0, 0.5 * np.sin(rate * TIME)) for k, rate in enumerate((3.0, 5.0, 9.0))}


def standard(recording: Recording, held_out: Recording | None = None) -> StandardModel:
    fitted, other = held_out_split(recording)
    return fit_standard_model(fitted, held_out or other, noise_with_links(recording))


def found(one: StandardModel) -> dict[str, float]:
    return {f"{t.effect.name}.{key}": t.values[key] for t in one.model.terms for key in t.fitted}


def test_what_is_stated_wrongly_is_recovered_from_noisy_readings(tmp_path: Path) -> None:
    one = standard(recorded(tmp_path, {**SWINGS, **SINES}))
    assert {"torque_gain@hinge", "viscous_friction@hinge", "coulomb_friction@hinge"} == set(one.otherwise)
    values = found(one)
    assert values["torque_gain.error"] == pytest.approx(GAIN - 1.0, abs=0.02)
    assert values["viscous_friction.damping"] == pytest.approx(VISCOUS, rel=0.1)
    assert values["coulomb_friction.friction"] == pytest.approx(DRY, rel=0.05)
    assert one.error < 0.05 * one.stated_error


def test_a_search_judges_it_as_one_of_its_sets(tmp_path: Path) -> None:
    """Three effects hide in it, and no law or pair of the search explains the motion."""
    recording = recorded(tmp_path, {**SWINGS, **SINES})
    effects = (find_effect("nonlinear_drag"), find_effect("command_delay"))
    one = standard(recording)
    search = Search(*held_out_split(recording), noise_with_links(recording), effects, lambda line: None)
    assert decide(find(search)).kind == "unknown_effect"
    verdict = decide(find(search, one.proposal))
    assert verdict.kind == "missing_effect"
    assert named_by(verdict.chosen.effects) == named_by(one.effects)
    assert verdict.chosen.error < 1.1


def test_swings_without_any_command_have_their_scale_from_gravity_and_inertia(tmp_path: Path) -> None:
    values = found(standard(recorded(tmp_path, SWINGS)))
    assert values["viscous_friction.damping"] == pytest.approx(VISCOUS, rel=0.1)
    assert values["coulomb_friction.friction"] == pytest.approx(DRY, rel=0.05)


def test_a_fit_that_is_worse_on_the_held_out_trials_is_refused(tmp_path: Path) -> None:
    """A machine that is as stated where it is judged by, and another one where it is fitted."""
    recording = recorded(tmp_path, SINES)
    shooting, stated = Shooting(recording, ()), nominal_model(recording)
    runs = shooting.free_runs([stated])[0]
    as_stated = recording.with_trials(
        [replace(trial, position=run.position) for trial, run in zip(recording.trials, runs, strict=True)]
    )
    one = standard(recording, as_stated)
    assert one.model == stated
    assert one.otherwise == ()
    other = standard(recording).model
    judge = HeldOut(shooting, as_stated, noise_with_links(recording), stated.offsets)
    assert judge.worse(other, stated)
    assert not judge.worse(stated, other)


def test_a_reading_step_is_found_in_the_log_and_none_where_there_is_none() -> None:
    motion = np.sin(np.linspace(0.0, 9.0, 5000))
    step = 2.0 * np.pi / 4096
    assert reading_step(step * np.round(motion / step)) == pytest.approx(step, rel=1e-3)
    assert reading_step((step * np.round(motion / step)).astype(np.float32).astype(float)) == pytest.approx(
        step, rel=0.01
    )
    assert reading_step(motion + 1e-4 * np.random.default_rng(0).standard_normal(5000)) == 0.0
    assert reading_step(np.zeros(100)) == 0.0


def test_errors_far_outside_the_others_count_in_proportion_and_not_squared() -> None:
    error = np.abs(np.random.default_rng(0).standard_normal((20, 50)))
    error[3, 7] = 100.0
    weight = soft_l1(error, np.ones_like(error))
    assert weight[error < 1.0].min() > 0.85
    assert weight[3, 7] * 100.0 == pytest.approx(2.0 * np.median(error) / 0.6745, rel=0.03)
