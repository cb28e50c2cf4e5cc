"""An episode as a Rerun recording: hand, cube and contacts in 3D, the task at 10 Hz, the joints at 500 Hz."""

from __future__ import annotations

from pathlib import Path

import rerun as rr

from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.visualization.blueprint import episode_blueprint
from tactile_cube.visualization.branch import Branch
from tactile_cube.visualization.episode_scene import log_hand, log_motion
from tactile_cube.visualization.episode_signals import log_joints, log_policy, log_task
from tactile_cube.visualization.recording_file import recording_file


def write_recording(record: EpisodeRecord, path: Path, hand: Hand = DLR_HAND2, summary: str = "") -> None:
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
    log_task(branch, record)
    log_joints(branch, record)
    log_policy(branch, record, hand)
    text = summary or f"ended: {record.ending}"
    branch.log("episode", rr.TextDocument(text, media_type="text/markdown"))
