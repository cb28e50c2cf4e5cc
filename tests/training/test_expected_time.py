"""The time announced beside what the benchmark measured."""

import pytest

from tactile_cube.agent.settings import AgentSettings
from tactile_cube.training import expected_time
from tactile_cube.training.expected_time import expected_seconds
from tactile_cube.training.settings import CollectorSettings, TrainingSettings

BESIDE, IN_TURNS = CollectorSettings(processes=1), CollectorSettings(kind="single")


@pytest.mark.parametrize(("precision", "measured"), [("bf16", 327.0), ("fp32", 82.9)])
def test_steps_a_second_on_two_cores_are_those_of_the_benchmark(
    precision: str, measured: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(expected_time, "MULTIPLIES_BF16", True)
    agent = AgentSettings.model_validate({"precision": precision})
    rate = 1e6 / expected_seconds(1_000_000, agent, BESIDE, TrainingSettings())
    assert rate == pytest.approx(measured, rel=0.3)  # SACLoss is a little slower than sac_fast in fp32


def test_where_bfloat16_goes_by_float32_it_saves_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expected_time, "MULTIPLIES_BF16", False)
    times = {
        expected_seconds(1000, AgentSettings(precision=p), BESIDE, TrainingSettings()) for p in ("bf16", "fp32", "auto")
    }
    assert len(times) == 1


def test_simulating_and_learning_in_turns_takes_their_sum() -> None:
    learning, nothing = TrainingSettings(), TrainingSettings(updates_per_iteration=0)
    times = [expected_seconds(1000, AgentSettings(), IN_TURNS, training) for training in (learning, nothing)]
    beside = expected_seconds(1000, AgentSettings(), BESIDE, learning)
    assert times[0] == pytest.approx(times[1] + beside)


def test_a_small_network_leaves_the_time_to_the_simulation() -> None:
    small = AgentSettings(hidden=(64, 64))
    assert expected_seconds(457, small, BESIDE, TrainingSettings()) == pytest.approx(1.0)
