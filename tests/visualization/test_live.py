"""A run that somebody looks at learns the same, to the bit, and shows what it has learned."""

import io
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import tactile_cube
from tactile_cube.agent.policy_file import PolicyInfo, load_policy
from tactile_cube.env import Conditions
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import find_policy
from tactile_cube.visualization.live import LiveView, request_line
from tactile_cube.visualization.live_episodes import FILE, serve, under
from tests.api.test_learning import SHORT
from tests.visualization.test_episode_recording import listed, rows

RUN = [*SHORT, "training.steps=200", "task.episode_steps=10", "logger=csv"]
LIVE = ["visualization=live", "visualization.live.viewer=file", "visualization.live.every=4"]


def read_policy(path: Path) -> tuple[list[bytes], PolicyInfo]:
    """Weights, byte for byte, and what the file says of the run."""
    actor, info = load_policy(path)
    return [parameter.numpy().tobytes() for parameter in actor.parameters()], info


def test_a_run_that_is_watched_learns_the_same_bit_for_bit_and_shows_episodes(tmp_path: Path) -> None:
    watched = tactile_cube.train(*RUN, *LIVE, folder=tmp_path / "watched" / "run")
    alone = tactile_cube.train(*RUN, folder=tmp_path / "alone" / "run")
    for mine, theirs in zip(*(read_policy(result.policy) for result in (watched, alone)), strict=True):
        assert mine == theirs
    curves = [result.curve() for result in (watched, alone)]
    learned = [{key: values for key, values in curve.items() if "hours" not in key} for curve in curves]
    assert repr(learned[0]) == repr(learned[1])  # some are not a number
    shown = watched.folder / FILE
    told = listed(shown, "/episode", "TextDocument:text")
    assert told
    assert all(text[0].startswith("# run: ") for text in told)
    assert len(rows(shown, "/task/theta", "Scalars:scalars")) >= 2 * len(told)
    assert listed(shown, "/curves", "EncodedImage:media_type") != []
    assert not (alone.folder / FILE).exists()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"every": 0}, r"visualization\.live\.every=0: give at least 1"),
        (
            {"viewer": "televison"},
            r"visualization\.live\.viewer=televison: choose auto, window, web, file, or give a URL",
        ),
    ],
)
def test_settings_without_a_meaning_are_refused(tmp_path: Path, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        LiveView(tmp_path, 0, **settings)


def test_a_run_outlives_the_process_that_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "policy.safetensors").write_bytes(b"")
    live = LiveView(tmp_path, 0, every=1, viewer="file")
    assert live.process is not None
    live.process.send_signal(signal.SIGKILL)
    live.process.wait()
    for episodes in (1, 2, 3):
        live.log(episodes, {"episodes": float(episodes), **Conditions(0.5, 1.0, 1.0).columns()})
    live.close()
    assert capsys.readouterr().err.count("the run goes on without") == 1


@pytest.mark.parametrize(
    ("asked", "patience", "status", "told"),
    [
        (True, 60.0, 0, ["draws what it was asked for last"]),
        (True, 0.1, -signal.SIGTERM, ["draws what it was asked for last", "not drawn in time"]),
        (False, 60.0, -signal.SIGTERM, []),
    ],
    ids=["it ends by itself", "it takes too long", "nothing was asked for"],
)
def test_the_end_of_a_run_waits_for_the_episode_that_was_asked_for_and_says_so(
    asked: bool,
    patience: float,
    status: int,
    told: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    draws = f"import sys, time; sys.stdin.read(); time.sleep({2 if status == 0 else 60})"
    monkeypatch.setattr("tactile_cube.visualization.live.SILENCE", 0.5)
    monkeypatch.setattr("tactile_cube.visualization.live.PATIENCE", patience)
    monkeypatch.setattr(
        "tactile_cube.visualization.live._start",
        lambda folder, viewer: subprocess.Popen([sys.executable, "-c", draws], stdin=subprocess.PIPE, bufsize=0),
    )
    (tmp_path / "policy.safetensors").write_bytes(b"")
    live = LiveView(tmp_path, 0, viewer="file")
    process = live.process
    assert process is not None
    if asked:
        live.log(1, {"episodes": 1.0, **Conditions(0.5, 1.0, 1.0).columns()})
    live.close()
    assert process.returncode == status
    printed = capsys.readouterr().err.splitlines()
    assert len(printed) == len(told)
    assert all(words in line for words, line in zip(told, printed, strict=True))


def test_of_requests_that_wait_only_the_newest_is_drawn() -> None:
    drawn: list[tuple[int, Conditions]] = []

    class Episodes:
        def show(self, steps: int, conditions: Conditions) -> None:
            drawn.append((steps, conditions))

    lines = "".join(request_line(steps, Conditions(0.3, 0.01 * steps, 0.5)) for steps in range(100))
    serve(io.StringIO(lines), Episodes())  # type: ignore[arg-type]
    assert drawn[-1] == (99, Conditions(0.3, 0.99, 0.5))
    assert len(drawn) < 100


def test_an_episode_is_shown_where_the_curriculum_stands() -> None:
    task = under(Conditions(0.17, 0.4, 1.0), find_policy("default")).task
    assert (task.filter_time, task.gravity_scale) == (0.17, 0.4)
