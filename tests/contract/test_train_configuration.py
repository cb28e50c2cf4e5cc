"""Every choice of train's configuration composes and instantiates."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from tactile_cube.agent.batch import Sizes
from tactile_cube.cli import CONFIG
from tactile_cube.training.environment import as_environment
from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings

GROUPS = ("task", "reward", "randomization", "start", "exploration", "curriculum", "agent", "collector", "training")
CHOICES = [f"{group}={file.stem}" for group in GROUPS for file in sorted((CONFIG / group).glob("*.yaml"))]
CHOICES += [f"+experiment={file.stem}" for file in sorted((CONFIG / "experiment").glob("*.yaml"))]


@pytest.fixture(scope="module", autouse=True)
def hydra_configuration() -> Iterator[None]:
    with initialize_config_dir(str(CONFIG.resolve()), version_base="1.3"):
        yield


def composed(*overrides: str) -> DictConfig:
    return compose("train", overrides=list(overrides))


@pytest.mark.parametrize("choice", CHOICES)
def test_choice_composes_and_instantiates(choice: str) -> None:
    config = composed(choice)
    plain = OmegaConf.to_container(config, resolve=True)
    assert isinstance(plain, dict)
    environment = as_environment(instantiate(config.env))
    assert environment.sizes == Sizes(120, 25, 12)
    assert environment.reward_weights({}).shape == (environment.reward_terms,)
    agent = instantiate(config.agent, _partial_=True)(environment.sizes)
    assert agent.sizes == environment.sizes
    CollectorSettings(**plain["collector"])
    TrainingSettings(**plain["training"])
    RunSettings(name=config.name, seed=config.seed)


def test_paper_experiment_has_the_published_numbers() -> None:
    config = composed("+experiment=paper")
    agent, training, curriculum = config.agent, config.training, config.curriculum
    assert list(agent.hidden) == [512, 512]
    assert (agent.gamma, agent.target_entropy, agent.alpha_init) == (0.9, -6, 0.2)
    assert (agent.weight_decay, agent.batch_size) == (2.5e-4, 256)
    assert (training.steps_per_iteration, training.updates_per_iteration) == (25, 100)
    assert (training.learning_starts, training.random_steps, training.replay_size) == (2000, 10000, 150000)
    assert config.collector.worlds == 12
    assert (curriculum.begin, curriculum.length) == (2e6, 4e6)
    assert (curriculum.filter_time, curriculum.gravity_scale) == (0.12, 0.05)


def test_finetune_experiment_has_the_published_numbers() -> None:
    config = composed("+experiment=finetune")
    assert (config.agent.gamma, config.agent.target_entropy) == (0.92, -8)
    assert config.training.replay_size == 1_500_000
    assert config.task.episode_steps == 200
    assert config.reward.fastest == 0.7
    assert config.randomization.sensor_noise == 0.02


def test_loggers_write_into_the_run_folder(tmp_path: Path) -> None:
    for option in ("default", "csv"):
        (tmp_path / option).mkdir()
        for entry in composed(f"logger={option}").logger.values():
            logger = instantiate(entry, _partial_=True)(folder=tmp_path / option, resumed_at=0)
            logger.log(1, {"a": 1.0})
            logger.close()
        assert "1" in (tmp_path / option / "metrics.csv").read_text()


def test_default_worker_count_divides_the_worlds() -> None:
    for worlds in range(1, 13):
        settings = CollectorSettings(worlds=worlds)
        assert worlds % settings.workers == 0


@pytest.mark.parametrize("part", sorted(file.stem for file in (CONFIG / "without").glob("*.yaml")))
def test_an_ablation_changes_the_recipe_and_makes_an_environment(part: str) -> None:
    # a sweep puts its own choices before what is typed; whichever comes first, the part has the last word
    recipe, ablated = composed("+experiment=ablations"), composed(f"without={part}", "+experiment=ablations")
    assert ablated == composed("+experiment=ablations", f"without={part}")
    assert (ablated == recipe) == (part == "nothing")
    assert as_environment(instantiate(ablated.env)).sizes.action == 12
