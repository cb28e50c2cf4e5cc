import pytest
from omegaconf import OmegaConf

from tactile_cube.api.job import worded_job
from tactile_cube.composition import CONFIG, composed
from tactile_cube.errors import InputError
from tactile_cube.evaluation.policies import HoldPolicy, PolicySource, environment, find_policy, worlds
from tactile_cube.randomization import StartStates

EXPERIMENTS = sorted(file.stem for file in (CONFIG / "experiment").glob("*.yaml"))


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_what_any_experiment_teaches_can_be_tried(experiment: str) -> None:
    trained = OmegaConf.to_container(composed("train", [f"+experiment={experiment}"]), resolve=True)
    made = environment(composed("evaluate", []), PolicySource(HoldPolicy(), experiment, config=trained), {})  # type: ignore[arg-type]
    assert made.task.name == trained["env"]["task"]["name"]  # type: ignore[index,call-overload]
    assert (made.curriculum, made.exploration) == (None, None)


def test_a_policy_is_not_tried_on_another_hand_or_in_two_engines() -> None:
    job = worded_job("evaluate", ("hand=three_finger",))
    with pytest.raises(InputError, match="trained on hand dlr_hand2, not three_finger"):
        environment(job.config, find_policy("published"), job.choices)
    job = worded_job("evaluate", ("engine=mixed",))
    with pytest.raises(InputError, match="engine=mixed: choose bullet or mujoco"):
        environment(job.config, find_policy("published"), job.choices)


@pytest.mark.parametrize(
    ("words", "drawn"),
    [
        (["protocol=paper"], {"randomization": "paper", "start": "paper"}),
        (["protocol=many"], {"randomization": "paper", "start": "paper"}),
        (["protocol=replay"], {"randomization": "paper", "start": "paper"}),
        (["protocol=endurance", "randomization=none"], {"randomization": "none", "start": "paper"}),
        (
            ["protocol=paper", "protocol.worlds=training"],
            {"randomization": "as in training", "start": "as in training"},
        ),
        (["protocol=standard", "start=wide_yaw"], {"randomization": "as in training", "start": "wide_yaw"}),
    ],
)
def test_protocols_of_the_paper_draw_its_worlds_unless_others_are_named(words, drawn) -> None:
    job, policy = worded_job("evaluate", tuple(words)), find_policy("published")
    made = environment(job.config, policy, job.choices)
    assert worlds(job.config, policy, job.choices) == drawn
    noise = {"paper": 0.002, "none": 0.0, "as in training": 0.02}
    assert made.randomization.sensor_noise == noise[drawn["randomization"]]
    assert isinstance(made.start, StartStates)
    assert made.start.poses == (1 if drawn["start"] == "paper" else 27)
