"""The guide docs/own_effect.md: its class, in the fit and in the world that policies train in."""

import re
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain.effects import find_effect, import_own_effects
from tactile_cube.env import Task
from tactile_cube.identification.identification import identify_effects
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.recordings.writing import write_recording
from tactile_cube.measurement.sources.simulated_rig import SimulatedRig
from tactile_cube.transforms import EnvConfig
from tactile_cube.transforms.make_env import rotation_env

ROOT = Path(__file__).parents[2]
BENCH = {
    "joints": ["q2"],
    "hidden": ["my_rig.CableDrag@q2: tension=0.02, friction=1.5"],
    "controller": {"kp": 3.69, "kd": 0.25, "torque_limit": 1.0},
    "nominal": {"stiffness": 25.0, "static_friction": 0.02, "reflected_inertia": 0.003},
    "true_spread": 0.0,
    "kinds": ("ramps", "multisine"),
    "initialisations": 2,
    "duration": 4.0,
    "validation": False,
}


@pytest.fixture(autouse=True)
def rig_on_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    import_own_effects(["my_rig.CableDrag"])


def test_the_guide_shows_the_file_and_it_is_short() -> None:
    shown = re.findall(r"```python\n(.*?)```", (ROOT / "docs/own_effect.md").read_text(), re.DOTALL)
    source = (ROOT / "examples/my_rig.py").read_text()
    assert shown[0] == source
    assert len(source.splitlines()) < 30


def test_the_guides_class_is_fitted(tmp_path: Path) -> None:
    write_recording(tmp_path / "bench", SimulatedRig(**BENCH).recordings(seed=0)[""])
    found = identify_effects(read_recording(tmp_path / "bench"), ["my_rig.CableDrag@q2"], 0.002, 0, lambda line: None)
    (term,) = found.fitted.model.terms
    assert term.label == "my_rig.CableDrag@q2"
    assert term.values["tension"] == pytest.approx(0.02, rel=0.2)
    assert term.values["friction"] == pytest.approx(1.5, rel=0.1)
    stages = list(found.stages.values())
    assert stages[-1].overall < 0.5 * stages[-2].overall


def test_the_guides_class_slows_the_hand_in_the_training_world() -> None:
    swept = []
    for tension in (0.0, 0.3):
        env = rotation_env(EnvConfig(Task("full"), effects=[f"my_rig.CableDrag@q2: tension={tension}, friction=1.5"]))
        env.reset()
        start = env.world.q.copy()
        for _ in range(5):
            env.step(np.ones(12))
        swept.append(np.abs(env.world.q - start)[1::3].max())
    assert find_effect("my_rig.CableDrag").parameters[0].neutral == 0.0
    assert swept[1] < swept[0] - 0.01
