"""Files of Rerun recordings leave nothing running behind."""

from pathlib import Path

import psutil
import rerun as rr
import rerun.blueprint as rrb

from tactile_cube.visualization.rerun_recording import recording_file


def write(path: Path) -> int:
    """Write a recording; how many threads this process has after it."""
    with recording_file(path, rrb.Blueprint()) as stream:
        stream.log("angle", rr.Scalars(1.0))
    return psutil.Process().num_threads()


def test_a_file_leaves_no_threads_behind(tmp_path: Path) -> None:
    after = [write(tmp_path / f"{number}.rrd") for number in range(6)]
    assert after[-1] - after[1] <= 2, "but those that Rerun shares among recordings"
    assert all(b"blueprint" in (tmp_path / f"{number}.rrd").read_bytes() for number in range(6))


def test_a_recording_in_use_is_left_alone(tmp_path: Path) -> None:
    used = rr.RecordingStream("tactile_cube", recording_id="used")
    used.save(tmp_path / "used.rrd")
    write(tmp_path / "other.rrd")
    used.log("text", rr.TextDocument("after the other one"))
    used.disconnect()
    assert (
        b"after the other one" in (tmp_path / "used.rrd").read_bytes() or (tmp_path / "used.rrd").stat().st_size > 2000
    )
