"""What all windows share, without a window."""

from pathlib import Path

import numpy as np

from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.workbench.desk import Desk
from tests.workbench.small_bench import STRIBECK


def done(desk: Desk) -> None:
    """Wait until the worker has nothing left to do; a look that gave way stands at the end of the queue once more."""
    for _ in range(3):
        desk._worker.submit(lambda: None).result()


def test_a_change_is_made_before_the_look_that_it_outdates_and_two_windows_that_look_share_one(
    measured: Recording, tmp_path: Path
) -> None:
    desk = Desk(tmp_path)
    desk.open(str(measured.folder))
    done(desk)
    desk.look("a")
    desk.change("adding", lambda bench: bench.add(STRIBECK))
    done(desk)
    assert desk.bench is not None
    assert desk.bench.effects == [STRIBECK]
    names = [one.name for twins in desk.looks["a"] for one in twins]
    assert "stribeck_friction" not in names, "the model has it"

    desk.open(str(measured.folder))
    done(desk)
    assert desk.bench.effects == [], "a recording takes the place of another one"
    for _ in range(3):
        desk.look("a")
    done(desk)
    assert desk.looks["a"][0][0].name == "stribeck_friction", "windows do not drive each other away"

    version = desk.version
    desk.change("adding", lambda bench: bench.add("stribeck_frition@a"))
    done(desk)
    assert "did you mean stribeck_friction" in desk.problem
    assert desk.version == version, "what is refused changes nothing"
    desk.look("a")
    done(desk)
    assert desk.problem, "and is shown until more is asked"
    desk.open(str(measured.folder / "nothing*.csv"))
    done(desk)
    assert "no recording's folder" in desk.problem
    desk.stop()


def test_what_came_back_is_added_to_the_recording_that_is_open(measured: Recording, tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    files = sorted(measured.folder.glob("*.parquet"))

    def imported(count: int, gains: dict[str, str], together: bool) -> Recording:
        desk.take([one.name for one in files[:count]], [one.read_bytes() for one in files[:count]])
        done(desk)
        desk.import_waiting({f"controller.{key}": text for key, text in gains.items()}, {}, together)
        done(desk)
        assert desk.problem == ""
        assert desk.bench is not None
        return desk.bench.opened

    desk.open(str(measured.folder))
    more = imported(1, {"kp": "3.5"}, True)
    assert [trial.initialisation for trial in more.trials] == [0, 0, 0, 0, 1]
    assert more.trials[-1].kind == measured.trials[0].kind, "the same command"
    assert [float(trial.gains.kp[0]) for trial in more.trials] == [4.0, 4.0, 4.0, 4.0, 3.5]
    assert float(more.trials[-1].gains.kd[0]) == 0.2
    assert np.allclose(more.trials[2].position, measured.trials[2].position, atol=1e-6)
    stated = {"kp": "4.0", "kd": "0.2", "torque_limit": "4.0"}
    assert len(imported(3, stated, False).trials) == 3
    desk.open(str(measured.folder / "rig.urdf"))
    assert len(imported(2, stated, True).trials) == 2, "another rig"
