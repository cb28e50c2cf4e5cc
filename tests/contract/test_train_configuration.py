"""Every choice of train's configuration composes and instantiates; sources of recordings are those of their class."""

import inspect

import pytest
from hydra.utils import get_class, instantiate
from omegaconf import DictConfig, OmegaConf
from torchrl.objectives import SACLoss

from tactile_cube import composition
from tactile_cube.agent.networks import Sizes
from tactile_cube.composition import CONFIG
from tactile_cube.env import Conditions
from tactile_cube.training.build import as_environment
from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings

GROUPS = ("agent", "replay", "collector", "training")
"""Those of the environment are tried in transforms/test_environment_options.py."""
CHOICES = [f"{group}={file.stem}" for group in GROUPS for file in sorted((CONFIG / group).glob("*.yaml"))]
CHOICES += [f"+experiment={file.stem}" for file in sorted((CONFIG / "experiment").glob("*.yaml"))]


def composed(*overrides: str) -> DictConfig:
    return composition.composed("train", overrides)


@pytest.mark.parametrize("choice", CHOICES)
def test_choice_composes_and_instantiates(choice: str) -> None:
    config = composed(choice)
    plain = OmegaConf.to_container(config, resolve=True)
    assert isinstance(plain, dict)
    environment = as_environment(instantiate(config.env))
    joints = instantiate(config.hand).joints
    assert environment.sizes == Sizes(10 * joints, 13 + joints, joints)
    weights = environment.reward_weights(Conditions(0.12, 1.0, 1.0))
    assert weights.shape == (len(environment.terms),)
    agent = instantiate(config.agent, _partial_=True)(environment.sizes)
    assert agent.sizes == environment.sizes
    CollectorSettings(**plain["collector"])
    TrainingSettings(**plain["training"])
    RunSettings(name=config.name, seed=config.seed)


def test_torchrls_own_loss_runs_the_recipe() -> None:
    recipe, theirs = composed("+experiment=alone"), composed("+experiment=alone", "agent=sac")
    differing = {key for key in recipe.agent if recipe.agent[key] != theirs.agent[key]}
    assert differing <= {"_target_", "precision"}
    assert type(instantiate(theirs.agent, _partial_=True)(Sizes(120, 25, 12)).loss) is SACLoss


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


@pytest.mark.parametrize("source", sorted(path.stem for path in (CONFIG / "source").glob("*.yaml")))
def test_a_source_has_the_settings_of_its_class(source: str) -> None:
    settings = OmegaConf.to_container(composition.composed("record", [f"source={source}", "out=somewhere"]).source)
    cls = get_class(settings.pop("_target_"))
    assert set(settings) == set(inspect.signature(cls).parameters)
