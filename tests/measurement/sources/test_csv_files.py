from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.csv_files import CsvFiles
from tests.measurement.small_rig import URDF, table

COLUMNS = {"time": "t", "a": {"command": "goal1", "position": "pos1"}, "b": {"command": "goal2", "position": "pos2"}}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log in degrees and milliseconds with names of its own."""
    columns, degree = table(), 180 / np.pi
    frame = {"t": 1000 * columns["time"]}
    for number, joint in enumerate("ab", 1):
        frame[f"goal{number}"] = degree * columns[f"{joint}.command"]
        frame[f"pos{number}"] = degree * columns[f"{joint}.position"]
    polars.DataFrame(frame).write_csv(tmp_path / "log.csv")
    (tmp_path / "rig.urdf").write_text(URDF)
    return tmp_path / "log.csv"


def source(log: Path, **changes: object) -> CsvFiles:
    settings = {
        "files": [str(log)],
        "urdf": str(log.parent / "rig.urdf"),
        "columns": COLUMNS,
        "controller": {"kp": 3.0, "kd": 0.2, "torque_limit": 1.0},
        "angle_unit": "deg",
        "time_unit": "ms",
    }
    return CsvFiles(**(settings | changes))  # type: ignore[arg-type]


def test_a_log_with_its_own_names_and_units_becomes_a_recording(log: Path, tmp_path: Path) -> None:
    write_recording(tmp_path / "r", source(log).recordings(0)[""])
    recording = read_recording(tmp_path / "r")
    assert recording.warnings == ()
    assert recording.rate == pytest.approx(100.0)
    assert np.allclose(recording.trials[0].position[:, 1], table()["b.position"], atol=1e-6)
    assert recording.trials[0].torque is None


def test_without_the_unit_the_degrees_are_noticed(log: Path, tmp_path: Path) -> None:
    write_recording(tmp_path / "r", source(log, angle_unit="rad").recordings(0)[""])
    with pytest.raises(InputError, match="degrees"):
        read_recording(tmp_path / "r")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"columns": COLUMNS | {"time": "clock"}}, "column 'clock' is missing"),
        ({"columns": {"time": "t"}}, "source.columns: expected"),
        ({"angle_unit": "grad"}, "source.angle_unit=grad"),
        ({"kind": ["one", "two"]}, "2 values for 1 files"),
        ({"files": ["nothing-*.csv"]}, "no such file"),
    ],
)
def test_a_wrong_map_is_refused(log: Path, changes: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        source(log, **changes).recordings(0)
