"""An episode as a Rerun recording: hand, cube and contacts in 3D, the task at 10 Hz, the joints at 500 Hz."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rerun as rr

from tactile_cube.evaluation.episode_record import Array, EpisodeRecord
from tactile_cube.evaluation.training_curve import Curve
from tactile_cube.evaluation.verdict import EpisodeResult
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.visualization.blueprint import episode_blueprint, pair_blueprint
from tactile_cube.visualization.curves import write_learning_curves
from tactile_cube.visualization.episode_scene import FINGER_COLOURS, log_hand, log_motion
from tactile_cube.visualization.rerun_recording import Branch, Colours, recording_file

JOINT_COLOURS = ((235, 90, 80), (110, 200, 110), (110, 150, 255), (240, 190, 80), (190, 120, 230), (130, 210, 220))
SIGNALS = {"q": 1.0, "q_m": 0.75, "q_f": 0.6, "q_d": 0.45, "torque": 1.0}
"""Signals at the physics rate, and how bright their lines are."""
CONDITIONS = ("filter_time", "gravity_scale")


def write_episode(record: EpisodeRecord, path: Path, hand: Hand = DLR_HAND2, summary: str = "") -> None:
    """Write one episode with its blueprint; open it with `rerun FILE.rrd`.

    Args:
        record: the episode.
        path: file to write, `.rrd`.
        hand: the hand that acted.
        summary: Markdown shown beside the episode.
    """
    with recording_file(path, episode_blueprint(record.fingers, hand.name)) as stream:
        log_episode(Branch(stream), record, hand, summary)


def log_episode(branch: Branch, record: EpisodeRecord, hand: Hand, summary: str = "") -> None:
    """Write one episode into a recording: hand, object, contacts, task, joints, and what went through the policy.

    Args:
        branch: where in the recording.
        record: the episode.
        hand: the hand that acted.
        summary: Markdown shown beside the episode.
    """
    log_motion(branch, record, hand, log_hand(branch, hand))
    _log_task(branch, record)
    _log_joints(branch, record)
    _log_policy(branch, record, hand)
    text = summary or f"ended: {record.ending}"
    branch.log("episode", rr.TextDocument(text, media_type="text/markdown"))


def description(result: EpisodeResult) -> str:
    """Return what is said beside the episode in the viewer, in Markdown."""
    lines = [f"# {result.verdict.value.replace('_', ' ')}", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in result.as_dict().items()]
    return "\n".join(lines)


def _log_task(branch: Branch, record: EpisodeRecord) -> None:
    """Write theta, the terms of the reward, the fingers' forces and the conditions of the episode."""
    branch.lines("task/theta", record.time, record.theta, ["theta"])
    forces = np.zeros((record.steps + 1, len(record.fingers)))
    np.add.at(forces, (record.contacts.step, record.contacts.finger), record.contacts.normal_force)
    colours = [FINGER_COLOURS[index % len(FINGER_COLOURS)] for index in range(len(record.fingers))]
    branch.lines("task/force", record.time, forces, list(record.fingers), colours)
    for name, values in record.reward_terms.items():
        if np.any(values):  # terms that are switched off would only fill the legend
            branch.lines(f"task/reward/{name}", record.time[1:], values, [name])
    branch.lines("task/reward/sum", record.time[1:], record.reward, ["sum"])
    for name in CONDITIONS:
        if name in record.constants:
            branch.lines(f"curriculum/{name}", record.time, np.full(record.steps + 1, record.constants[name]), [name])


def _log_joints(branch: Branch, record: EpisodeRecord) -> None:
    """Write the joint signals of each finger at the physics rate, and its targets at the policy's."""
    for index, finger in enumerate(record.fingers):
        mine, entity = record.of_finger(index), f"joints/{finger}"
        for signal, brightness in SIGNALS.items():
            if signal in record.trace:
                colours = [tuple(round(brightness * part) for part in colour) for colour in JOINT_COLOURS]
                values = record.trace[signal][:, mine]
                _joint_lines(branch, f"{entity}/{signal}", record.trace["time"], values, signal, colours)
        _joint_lines(branch, f"{entity}/q_n", record.time[:-1], record.target[:, mine], "q_n")


def _log_policy(branch: Branch, record: EpisodeRecord, hand: Hand) -> None:
    """Write what the policy got of each finger, q_m and e_q with offset and noise, and what it asked for [rad].

    The action differs from the target q_n where the one before was repeated (sticky actions).
    """
    if not record.policy:
        return
    middle = 0.5 * (hand.action_lower + hand.action_upper)
    asked = middle + 0.5 * (hand.action_upper - hand.action_lower) * record.policy["action"]
    for index, finger in enumerate(record.fingers):
        mine = record.of_finger(index)
        for name, values in (("q_m", record.policy["q_m"]), ("e_q", record.policy["e_q"]), ("action", asked)):
            entity = f"policy/{finger}/{name}"
            _joint_lines(branch, entity, record.time[:-1], values[:, mine], name, JOINT_COLOURS)


def _joint_lines(
    branch: Branch, entity: str, time: Array, values: Array, signal: str, colours: Colours | None = None
) -> None:
    """A signal (n, joints) of one finger; colours go round where it has more joints than there are."""
    count = values.shape[1]
    painted = None if colours is None else [colours[joint % len(colours)] for joint in range(count)]
    branch.lines(entity, time, values, [f"{signal}, joint {joint + 1}" for joint in range(count)], painted)


PICTURE = (6.0, 6.0)
"""Size of the learning curves [inch]: a column beside the episodes."""


def write_pair(
    path: Path,
    episodes: Mapping[str, tuple[EpisodeRecord, str, str]],
    hand: Hand,
    curve: Curve | None,
    words: str,
) -> None:
    """Write episodes side by side on one time line.

    Args:
        path: file to write, `.rrd`.
        episodes: path below which each is written -> record, name, Markdown that describes it.
        hand: the hand that acted.
        curve: learning curve of the run; None: there is none.
        words: Markdown about the run.
    """
    names = {root: name for root, (_, name, _) in episodes.items()}
    fingers = next(iter(episodes.values()))[0].fingers
    with recording_file(path, pair_blueprint(fingers, hand.name, names, curve is not None)) as stream:
        for root, (record, _, described) in episodes.items():
            log_episode(Branch(stream, f"{root}/"), record, hand, described)
        branch = Branch(stream)
        if curve is not None:
            log_curves(branch, curve)
        branch.always("run", rr.TextDocument(words, media_type="text/markdown"))


def log_curves(branch: Branch, curve: Curve) -> None:
    """Write the learning curves as a picture: a plot of the viewer would share the time line of the episodes."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "curves.png"
        write_learning_curves([curve], file, curve.label, PICTURE)
        branch.log("curves", rr.EncodedImage(path=file))
