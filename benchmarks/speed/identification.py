"""Section: fit the constants of a simulated finger to its recording; diagnose a whole bench session."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.speed.command import run_and_watch
from benchmarks.speed.mujoco_sysid import fit_finger
from benchmarks.speed.peers import find_peer
from benchmarks.speed.report import Figure, Section
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.error import free_run_error
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.replay.simulator import free_run
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tactile_cube.measurement.split import held_out_split

YARDSTICK = "mujoco.sysid"
CONTROLLER = {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0}
NOMINAL = {"stiffness": float("inf"), "static_friction": 0.02, "reflected_inertia": 0.003}
HIDDEN = ((), ("stribeck_friction@q3",), ("command_delay", "backlash@q2"))
"""What the sessions that are diagnosed have and their model lacks."""
STEP = 0.002


def identification(
    rounds: int,
    peers: bool = True,
    duration: float = 8.0,
    kinds: int = 3,
    session: float = 12.0,
    hidden: Sequence[Sequence[str]] = HIDDEN,
    bench: Mapping[str, Any] | None = None,
) -> Section:
    """Damping, dry friction and rotor inertia of three joints, from trials without joint offsets.

    Args:
        rounds: fits a figure, at most 3.
        peers: whether to measure other people's programs too.
        duration: of a trial [s].
        kinds: of excitation, one trial each.
        session: duration of a trial of the sessions that are diagnosed [s].
        hidden: effects of each of these sessions.
        bench: further settings of these sessions, of `SimulatedRig`.
    """
    title = f"fit of a finger's constants to trials of {duration:g} s; note: free-running error on held-out trials"
    section = Section("identification", title, YARDSTICK)
    recording = simulated_recording(duration, kinds)
    fitted, held_out = held_out_split(recording, seed=0)
    mujoco = find_peer("mujoco", section.missing) if peers else None
    sysid = find_peer("mujoco.sysid", section.missing, needs="optimize") if mujoco is not None else None
    found: dict[str, tuple[list[float], float]] = {}
    _ours(fitted, held_out)  # compiles the finger's kernels
    for _ in range(min(rounds, 3)):
        _note(found, "tactile_cube, base fit", *_ours(fitted, held_out))
        if mujoco is not None and sysid is not None:
            _note(found, YARDSTICK, *_theirs(mujoco, sysid, fitted, held_out))
    section.figures = [*_figures(found), *diagnoses(session, hidden, bench or {})]
    return section


def diagnoses(trial: float, hidden: Sequence[Sequence[str]], bench: Mapping[str, Any]) -> list[Figure]:
    """Diagnoses of bench sessions, of 12 trials with a finger's three joints, once each: they take long.

    The whole command, from its start to the written report; the finger's kernels are compiled before.

    Args:
        trial: duration of a trial [s].
        hidden: effects of each session.
        bench: further settings.
    """
    nominal = NOMINAL | {"stiffness": 25.0}
    figures = []
    for names in [(), *hidden]:
        settings: dict[str, Any] = {"hidden": names, "duration": trial, "validation": False, **bench}
        tables = SimulatedRig(controller=CONTROLLER, nominal=nominal, **settings).recordings(seed=3)[""]
        with tempfile.TemporaryDirectory() as folder:
            write_recording(Path(folder, "bench"), tables)
            words = [f"recording={folder}/bench", f"hydra.run.dir={folder}/run"]
            spent = run_and_watch(["tactile_cube.diagnose", *words])
            verdict = json.loads(Path(folder, "run", "diagnosis.json").read_text(encoding="utf-8"))["verdict"]
        name = f"diagnosis, {' and '.join(names) or 'nothing'} hidden"
        note = f"{len(tables.tables)} trials of {trial:g} s, {spent.wall:.0f} s on the clock: {verdict}"
        figures.append(Figure(name, spent.cpu, spent.cpu, spent.cpu, "s of processor time", None, note))
    return figures[1:]  # the first one compiled


def simulated_recording(duration: float, kinds: int) -> Recording:
    """A finger on a bench, in three initialisations without joint offsets."""
    source = SimulatedRig(
        controller=CONTROLLER,
        nominal=NOMINAL,
        kinds=("multisine", "ramps", "policy")[:kinds],
        initialisations=2,
        offset=0.0,
        duration=duration,
        validation=False,
    )
    return _recorded(source, seed=0)


def _recorded(source: SimulatedRig, seed: int) -> Recording:
    with tempfile.TemporaryDirectory() as folder:
        ((_, tables),) = source.recordings(seed).items()
        write_recording(Path(folder), tables)
        return read_recording(folder)


def _note(found: dict[str, tuple[list[float], float]], name: str, seconds: float, error: float) -> None:
    found.setdefault(name, ([], error))[0].append(seconds)


def _ours(fitted: Recording, held_out: Recording) -> tuple[float, float]:
    """Processor seconds of the fit, and the error on the held-out trials [rad]."""
    began = time.process_time()
    search = Search(fitted, held_out, sensor_noise(fitted), (), lambda line: None)
    base = search.base
    seconds = time.process_time() - began
    model = base.judgement.model
    return seconds, free_run_error(held_out, free_run(held_out, model, step=STEP)).overall


def _theirs(mujoco: ModuleType, sysid: ModuleType, fitted: Recording, held_out: Recording) -> tuple[float, float]:
    began = time.process_time()
    fit = fit_finger(mujoco, sysid, fitted, STEP)
    return time.process_time() - began, fit.error(held_out)


def _figures(found: dict[str, tuple[list[float], float]]) -> list[Figure]:
    base = float(np.median(found[YARDSTICK][0])) if YARDSTICK in found else None
    figures = []
    for name, (seconds, error) in found.items():
        low, median, high = (float(value) for value in np.quantile(seconds, [0.25, 0.5, 0.75]))
        ratio = None if base is None else base / median
        figures.append(Figure(name, median, low, high, "CPU s", ratio, f"error {error * 1e3:.2f} mrad"))
    return figures
