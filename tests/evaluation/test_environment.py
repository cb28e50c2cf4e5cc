import pytest
from omegaconf import OmegaConf

from tactile_cube.command_help import CONFIG
from tactile_cube.composition import composed
from tactile_cube.evaluation.environment import environment
from tactile_cube.evaluation.policies import HoldPolicy
from tactile_cube.evaluation.policy_source import PolicySource

EXPERIMENTS = sorted(file.stem for file in (CONFIG / "experiment").glob("*.yaml"))


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_what_any_experiment_teaches_can_be_tried(experiment: str) -> None:
    trained = OmegaConf.to_container(composed("train", [f"+experiment={experiment}"]), resolve=True)
    made = environment(composed("evaluate", []), PolicySource(HoldPolicy(), experiment, config=trained), {})  # type: ignore[arg-type]
    assert made.task.name == trained["env"]["task"]["name"]  # type: ignore[index,call-overload]
    assert (made.curriculum, made.exploration) == (None, None)
