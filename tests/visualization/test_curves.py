from pathlib import Path

from PIL import Image

from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.protocol import Variant
from tactile_cube.evaluation.summary import summarise
from tactile_cube.evaluation.training_curve import read_curve
from tactile_cube.evaluation.verdict import judge_episode
from tactile_cube.visualization.charts import write_learning_curves, write_robustness_map
from tests.evaluation.synthetic import episode

METRICS = (
    "steps,final_angle,T_s,gravity\n0,,0.12,0.05\n1000,0.5,0.12,0.05\n2000,1.0,0.3,0.5\n3000,2.5,0.5,1\n4000,3,0.5,1\n"
)


def write_metrics(folder: Path, text: str = METRICS) -> Path:
    (folder / "metrics.csv").write_text(text)
    return folder


def test_learning_curves_become_a_picture(tmp_path: Path) -> None:
    curve = read_curve(write_metrics(tmp_path), "seed 0")
    write_learning_curves(curve, tmp_path / "curves.png")
    with Image.open(tmp_path / "curves.png") as picture:
        assert picture.width > 500


def test_a_robustness_map_has_a_panel_for_each_axis(tmp_path: Path) -> None:
    variants = [Variant(), *(Variant(name=str(i), axis=f"axis {i % 4}", value=i) for i in range(8))]
    results = [judge_episode(episode(angle=3.0, steps=10))]
    write_robustness_map(
        [VariantResult(v, results, summarise(results), None) for v in variants], {"axis 1": 2.5}, tmp_path / "map.png"
    )
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.height > 400
