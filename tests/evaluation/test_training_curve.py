from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.training_curve import cpu_hours, curriculum_ends, read_curve, regrasping_begins

METRICS = """steps,final_angle,episodes,T_s,gravity,simulating_hours,learning_hours
0,,0,0.12,0.05,0,0
1000,3.5,10,0.12,0.05,0.1,0.1
2000,1.0,60,0.3,0.5,0.2,0.2
3000,3.1,90,0.5,1,0.3,0.4
4000,3.5,120,0.5,1,0.4,0.5
"""


def write_metrics(folder: Path, text: str = METRICS) -> Path:
    (folder / "metrics.csv").write_text(text)
    return folder


def test_begin_and_end_of_the_curriculum_are_found(tmp_path: Path) -> None:
    assert curriculum_ends(read_curve(write_metrics(tmp_path), "seed 0")) == [2, 3]


def test_a_curriculum_on_the_filter_constant_alone_is_marked_too(tmp_path: Path) -> None:
    text = "steps,final_angle,T_s,gravity\n0,,0.25,1\n1000,2,0.3,1\n2000,3,0.5,1\n3000,3,0.5,1\n"
    assert curriculum_ends(read_curve(write_metrics(tmp_path, text), "seed 0")) == [1, 2]
    still = text.replace("0.25", "0.5").replace("0.3", "0.5")
    assert curriculum_ends(read_curve(write_metrics(tmp_path, still), "seed 0")) == []


def test_regrasping_begins_when_a_full_window_exceeds_three_radians(tmp_path: Path) -> None:
    curve = read_curve(write_metrics(tmp_path), "seed 0")
    row = regrasping_begins(curve)
    assert row == 3
    assert cpu_hours(curve, row) == pytest.approx(0.7)


def test_a_run_that_never_regrasps_has_no_beginning(tmp_path: Path) -> None:
    text = METRICS.replace("3.1,90", "2.9,90").replace("3.5,120", "2.9,120")
    assert regrasping_begins(read_curve(write_metrics(tmp_path, text), "x")) is None


@pytest.mark.parametrize("text", ["", "steps,loss\n0,1\n"])
def test_a_file_without_the_angle_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"metrics\.csv: no column"):
        read_curve(write_metrics(tmp_path, text), "x")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_curve(tmp_path, "x")
