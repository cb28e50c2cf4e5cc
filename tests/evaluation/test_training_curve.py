from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.evaluation.training_curve import (
    median_interval,
    read_curve,
    read_sweep,
    regrasping_begins,
    sweep_table,
)

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


def test_regrasping_begins_when_a_full_window_exceeds_three_radians(tmp_path: Path) -> None:
    assert regrasping_begins(read_curve(write_metrics(tmp_path), "seed 0")) == 3
    text = METRICS.replace("3.1,90", "2.9,90").replace("3.5,120", "2.9,120")
    assert regrasping_begins(read_curve(write_metrics(tmp_path, text), "x")) is None


@pytest.mark.parametrize("text", ["", "steps,loss\n0,1\n"])
def test_a_file_without_the_angle_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"metrics\.csv: no column"):
        read_curve(write_metrics(tmp_path, text), "x")
    with pytest.raises(InputError, match="cannot be read"):
        read_curve(tmp_path / "nowhere", "x")


def run(folder: Path, name: str, angle: float, hours: float = 0.1) -> None:
    """A run of two rows that ends at 30 k steps."""
    rows = (
        f"steps,final_angle,episodes,simulating_hours,learning_hours\n15000,1.0,60,0,0\n30000,{angle},120,{hours},0\n"
    )
    (folder / f"{name}.csv").write_text(rows)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    run(tmp_path, "task.filter_time=0.5-task=table-seed0", 3.5, 0.10)
    run(tmp_path, "task.filter_time=0.5-task=table-seed1", 3.1, 0.30)
    run(tmp_path, "task.filter_time=0.5-task=table-seed2", 2.5)
    run(tmp_path, "agent.n_step=1-seed0", 1.2)
    return tmp_path


def test_a_setting_is_a_line_with_its_seeds_and_medians_in_which_runs_that_never_regrasp_count(folder: Path) -> None:
    lines = sweep_table(read_sweep(folder)).splitlines()
    rows = {cells[0]: cells[1:] for cells in ([cell.strip() for cell in line.split("|")[1:-1]] for line in lines)}
    assert rows["task=table, T_s 0.5 s"] == [
        "0.030, 0.030, > 0.030 (at 2.5 rad)", "0.030 (0.030 to never)", "3.10 (2.50 to 3.50)", "0.500"
    ]  # fmt: skip
    assert rows["agent.n_step=1"][:2] == ["> 0.030 (at 1.2 rad)", "never (never to never)"]


def test_published_settings_have_a_column_and_those_without_a_run_stand_as_such(folder: Path) -> None:
    table = sweep_table(read_sweep(folder), {"task=table, T_s 0.5 s": "0.3, 0.4", "task=full, T_s 0.5 s": "1.8, -"})
    assert "| task=table, T_s 0.5 s | 0.3, 0.4 | 0.030, 0.030, > 0.030 (at 2.5 rad) | 0.030 (" in table
    assert "| task=full, T_s 0.5 s | 1.8, - | not run |  |" in table
    assert "n_step" not in table


def test_run_folders_are_read_like_copies(folder: Path) -> None:
    (folder / "n_step=3-seed4").mkdir()
    (folder / "n_step=3-seed4" / "metrics.csv").write_text("steps,final_angle\n1500,0.5\n")
    assert list(read_sweep(folder)["n_step=3"]) == [4]


@pytest.mark.parametrize(
    ("runs", "low", "high"), [(1, 0, 0), (3, 0, 2), (5, 0, 4), (6, 0, 5), (8, 0, 7), (9, 1, 7), (20, 5, 14)]
)
def test_the_interval_of_a_median_is_the_sign_tests(runs: int, low: int, high: int) -> None:
    # ranks from the table of the sign test at 5 %, counted from zero
    assert median_interval([float(k) for k in reversed(range(runs))])[1:] == (low, high)


def test_a_folder_without_runs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no run <setting>-seed<N>"):
        read_sweep(tmp_path)
