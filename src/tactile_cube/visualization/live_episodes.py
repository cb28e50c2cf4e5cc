"""The process behind `visualization=live`: evaluates the newest policy of a run and streams the episode to a viewer.

Each line of its standard input asks for an episode; it ends with the input. Episodes follow one another on the time
line.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import queue
import signal
import sys
import threading
from pathlib import Path
from typing import TextIO

import rerun as rr
import torch

from tactile_cube.composition import composed
from tactile_cube.env import Conditions
from tactile_cube.errors import InputError
from tactile_cube.evaluation.environment import environment
from tactile_cube.evaluation.policies import PolicySource, find_policy
from tactile_cube.evaluation.rollout import run_episode
from tactile_cube.evaluation.training_curve import read_curve
from tactile_cube.evaluation.verdict import judge_episode
from tactile_cube.training.run import POLICY
from tactile_cube.transforms import EnvConfig, make_env
from tactile_cube.visualization.blueprint import live_blueprint
from tactile_cube.visualization.episode_recording import description, log_curves, log_episode
from tactile_cube.visualization.live import read_request
from tactile_cube.visualization.rerun_recording import APPLICATION, Branch
from tactile_cube.visualization.viewer import Viewer, start_viewer

NICENESS = 10
"""Beside a busy run it gets a tenth of a core: ready before the next episode is due, too little to be felt."""
STRIDE = 10
"""Every 10th sample of the physics rate is shown, 50 Hz: a viewer keeps hundreds of episodes then."""
PAUSE = 1.0
"""Between two episodes on the time line [s]."""
SEED = 0
"""Every episode begins alike, so that they can be compared."""
FILE = "live.rrd"


class LiveEpisodes:
    """Evaluates and draws.

    Args:
        folder: of the run.
        target: URL of a viewer, or file to write.
    """

    def __init__(self, folder: Path, target: str | Path):
        self._folder, self._target, self._start = folder, target, 0.0
        self._stream: rr.RecordingStream | None = None

    def show(self, steps: int, conditions: Conditions) -> None:
        """Run an episode of the newest policy under the conditions in force, and stream it.

        Args:
            steps: environment steps of the run.
            conditions: where the curriculum stands.
        """
        source = find_policy(str(self._folder / POLICY))
        config = under(conditions, source)
        env = make_env(config, 1, SEED, evaluation=True)
        try:
            record = run_episode(env, source.policy, SEED)
        finally:
            env.close()
        stream = self._opened(config)
        words = f"# {self._folder.name}: {steps} steps\n\n{description(judge_episode(record))}"
        branch = Branch(stream, start=self._start, stride=STRIDE)
        log_episode(branch, record, config.hand, words)
        with contextlib.suppress(InputError):  # no row of metrics yet
            log_curves(branch, read_curve(self._folder, self._folder.name))
        self._start += float(record.time[-1]) + PAUSE
        stream.flush()

    def close(self) -> None:
        """Write what is still in memory."""
        if self._stream is not None:
            self._stream.flush()
            self._stream.disconnect()

    def _opened(self, config: EnvConfig) -> rr.RecordingStream:
        if self._stream is None:
            self._stream = rr.RecordingStream(APPLICATION, recording_id=self._folder.name)
            fingers = [finger.name for finger in config.hand.fingers]
            seconds = config.task.episode_steps * config.simulation.policy_dt
            layout = live_blueprint(fingers, config.hand.name, seconds)
            if isinstance(self._target, Path):
                self._stream.save(self._target, default_blueprint=layout)
            else:
                self._stream.connect_grpc(self._target, default_blueprint=layout)
        return self._stream


def under(conditions: Conditions, source: PolicySource) -> EnvConfig:
    """The environment of a policy where its curriculum stands now, every physics step recorded."""
    config = environment(composed("evaluate", []), source, {})
    task = dataclasses.replace(config.task, filter_time=conditions.filter_time, gravity_scale=conditions.gravity_scale)
    return dataclasses.replace(config, task=task, simulation=dataclasses.replace(config.simulation, trace=True))


def serve(requests: TextIO, episodes: LiveEpisodes) -> None:
    """Draw what is asked for until the input ends; of requests that wait, only the newest."""
    waiting: queue.SimpleQueue[str | None] = queue.SimpleQueue()

    def read() -> None:
        for line in requests:
            waiting.put(line)
        waiting.put(None)

    threading.Thread(target=read, daemon=True).start()
    last = False
    while not last:
        newest = waiting.get()
        while newest is not None and not waiting.empty():
            following = waiting.get()
            last, newest = following is None, following or newest
        if newest is None:
            return
        episodes.show(*read_request(newest))


def open_target(folder: Path, viewer: str) -> tuple[str | Path, Viewer | None]:
    """Where the stream goes, and the viewer that was started for it; says where to look."""
    if viewer == "file":
        print(f"live view: the first episode begins {folder / FILE}", flush=True)
        return folder / FILE, None
    if "://" in viewer:
        return viewer, None
    started = start_viewer(viewer == "web")
    if started.page:
        print(f"live view: look at {started.page}", flush=True)
    return started.url, started


def main() -> None:
    """`python -m tactile_cube.visualization.live_episodes RUN VIEWER`."""
    os.nice(NICENESS)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # so that a server is ended with it
    torch.set_num_threads(1)
    folder, viewer = Path(sys.argv[1]), sys.argv[2]
    target, started = open_target(folder, viewer)
    episodes = LiveEpisodes(folder, target)
    try:
        serve(sys.stdin, episodes)
    except InputError as error:
        sys.exit(f"live view: {error}")
    finally:
        episodes.close()
        if started is not None and started.page:  # a window stays open; a server would go on for ever
            started.end()


if __name__ == "__main__":
    main()
