import json
from pathlib import Path

import pytest

from tactile_cube.env import Task
from tactile_cube.evaluation.evaluation import EvaluationRun, VariantResult, write_results
from tactile_cube.evaluation.policies import HoldPolicy, PolicySource
from tactile_cube.evaluation.protocol import Protocol, Variant
from tactile_cube.evaluation.summary import summarise
from tactile_cube.evaluation.verdict import judge_episode
from tests.evaluation.synthetic import episode


def test_results_come_back_with_every_episode(tmp_path: Path) -> None:
    results = [judge_episode(episode(angle=angle), number) for number, angle in enumerate((5.0, 2.0))]
    variant = VariantResult(Variant(), results, summarise(results))
    protocol, source = Protocol("paper"), PolicySource(HoldPolicy(), "hold")
    run = EvaluationRun(protocol, source, Task("full"), "mujoco", 4, "python -m x", 0.1, {"randomization": "wide"})
    write_results(tmp_path / "results.json", run, [variant])
    data = json.loads((tmp_path / "results.json").read_text())
    assert (data["protocol"], data["policy"]["label"], data["seed"], data["engine"]) == ("paper", "hold", 4, "mujoco")
    assert data["worlds"] == {"randomization": "wide"}
    rows = data["variants"][0]["episodes"]
    assert [(row["kept"], row["success"], row["tip_support"]) for row in rows] == [
        (True, True, 1.0),
        (True, False, 1.0),
    ]
    assert data["variants"][0]["summary"]["best_angle"] == pytest.approx(5.0)
