"""Best and worst episode of a run side by side in one Rerun recording, with the learning curves of the run."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import rerun as rr

from tactile_cube.evaluation.episode_record import EpisodeRecord
from tactile_cube.evaluation.training_curve import Curve
from tactile_cube.hand import Hand
from tactile_cube.visualization.blueprint import pair_blueprint
from tactile_cube.visualization.curves import write_learning_curves
from tactile_cube.visualization.episode_recording import log_episode
from tactile_cube.visualization.rerun_recording import Branch, recording_file

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
