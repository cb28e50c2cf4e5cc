from pathlib import Path

import pytest
from PIL import Image

from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.summary import summarise
from tactile_cube.evaluation.variant import Variant
from tactile_cube.evaluation.verdict import judge
from tactile_cube.visualization.curves import curriculum_ends, read_curve, write_learning_curves, write_robustness_map
from tests.evaluation.synthetic import episode

METRICS = (
    "steps,final_angle,T_s,gravity\n0,,0.12,0.05\n1000,0.5,0.12,0.05\n2000,1.0,0.3,0.5\n3000,2.5,0.5,1\n4000,3,0.5,1\n"
)


def write_metrics(folder: Path, text: str = METRICS) -> Path:
    (folder / "metrics.csv").write_text(text)
    return folder


def test_begin_and_end_of_the_curriculum_are_found(tmp_path: Path) -> None:
    assert curriculum_ends(read_curve(write_metrics(tmp_path), "seed 0")) == [2000, 3000]


def test_learning_curves_become_a_picture(tmp_path: Path) -> None:
    curve = read_curve(write_metrics(tmp_path), "seed 0")
    write_learning_curves([curve, curve], tmp_path / "curves.png", "table")
    with Image.open(tmp_path / "curves.png") as picture:
        assert picture.width > 500


@pytest.mark.parametrize("text", ["", "steps,loss\n0,1\n"])
def test_a_file_without_the_angle_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"metrics\.csv: no column"):
        read_curve(write_metrics(tmp_path, text), "x")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_curve(tmp_path, "x")


def test_a_robustness_map_has_a_panel_for_each_axis(tmp_path: Path) -> None:
    variants = [Variant(), *(Variant(name=str(i), axis=f"axis {i % 4}", value=i) for i in range(8))]
    results = [judge(episode(angle=3.0, steps=10))]
    write_robustness_map(
        [VariantResult(v, results, summarise(results, None), None) for v in variants], tmp_path / "map.png"
    )
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.height > 400
