"""The training environment: worlds, transforms in their order, and a generator of its own for the noise."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs import TransformedEnv
from torchrl.envs.transforms import CatFrames, CatTensors, Compose, ObservationNorm, RenameTransform, Transform

from tactile_cube.drivetrain.effects import Effect, parse_effect, resolve
from tactile_cube.drivetrain.model_file import as_model
from tactile_cube.env import Reward, RotationEnv, Task
from tactile_cube.env.worlds import WorldsEnv
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.hand.gait import similar_gaits
from tactile_cube.randomization import GraspStarts, GraspTable, Randomization, StartPoses, StartStates, identified
from tactile_cube.simulation import EpisodeConstants, SimulationOptions, World
from tactile_cube.simulation.health import unresolved
from tactile_cube.transforms.curriculum import Curriculum, Ramps
from tactile_cube.transforms.disturbances import JointOffset, SensorNoise, StickyAction
from tactile_cube.transforms.finger_exploration import Exploration, FingerExploration


class OwnGeneratorEnv(TransformedEnv):  # type: ignore[misc]
    """A transformed environment on whose random numbers torch's global generator has no influence, nor they on it.

    Its sequence begins with `set_seed`.
    """

    _generator: Tensor | None = None

    def set_seed(self, seed: int | None = None, static_seed: bool = False) -> int | None:
        """Seed worlds and noise; gives the next seed."""
        with self._drawing():
            following: int | None = super().set_seed(seed, static_seed=static_seed)
        return following

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: object) -> TensorDictBase:
        with self._drawing():
            return super()._reset(tensordict, **kwargs)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        with self._drawing():
            return super()._step(tensordict)

    @contextmanager
    def _drawing(self) -> Iterator[None]:
        with torch.random.fork_rng(devices=[]):
            if self._generator is not None:
                torch.set_rng_state(self._generator)
            yield
            self._generator = torch.get_rng_state()


ALMOST_ALL = 1.0 - 1e-9  # the fraction of draws below what counts as a distribution's largest value
DEEPEST_STACK = 1_000
PARTS: Mapping[str, tuple[type, ...]] = {
    "task": (Task,),
    "reward": (Reward,),
    "randomization": (Randomization,),
    "start": (StartStates, GraspStarts),
    "constants": (EpisodeConstants,),
    "simulation": (SimulationOptions,),
    "hand": (Hand,),
}
OBJECT_SCALE = (1.0 / 0.01,) * 3 + (1.0,) * 2 + (1.0 / 0.1,) * 2 + (1.0 / 0.05,) * 3 + (1.0,) * 3
"""Brings the object's state to the size of one: it moves by centimetres, tilts by 0.1 rad, has 0.05 m/s. The critics,
whose weights decay, could hardly use numbers a hundred times smaller than the joint angles beside them."""
GAITS = 64  # that demonstrations choose from


@dataclass(frozen=True)
class EnvConfig:
    """Everything that defines the environment; plain data that can be sent to another process.

    Attributes:
        hand: who does it; its number of joints gives the sizes of observations and actions.
        exploration: extra exploration in training.
        curriculum: how conditions change in training; None: they do not.
        constants: nominal constants, which the task and the randomization change.
        effects: effects of the drivetrain beyond the basic model: instances, or text such as `backlash@q2: play=0.02`.
        model: an identified model, as the path of its file, its contents or a ModelFile: its values, intervals and
            effects replace those of the drive in `constants` and `randomization`. None once that is done.
        stack: readings in an observation, N_stack.
        privileged: whether critics see the object's state; without it they see zeros.
    """

    task: Task
    reward: Reward = field(default_factory=Reward)
    randomization: Randomization = field(default_factory=Randomization)
    start: StartStates | GraspStarts = field(default_factory=StartStates)
    exploration: Exploration = field(default_factory=lambda: Exploration(episodes=0.0))
    curriculum: Ramps | None = None
    constants: EpisodeConstants = field(default_factory=EpisodeConstants)
    simulation: SimulationOptions = field(default_factory=SimulationOptions)
    effects: Sequence[Any] = ()
    model: Any = None
    stack: int = 5
    privileged: bool = True
    hand: Hand = DLR_HAND2

    def __post_init__(self) -> None:
        """Make the effects, put the model in place, and refuse values without a meaning."""
        object.__setattr__(self, "hand", self.hand or DLR_HAND2)  # null in the configuration
        for key, kinds in PARTS.items():
            if not isinstance(getattr(self, key), kinds):
                names = " or ".join(kind.__name__ for kind in kinds)
                raise InputError(f"env.{key} is {str(getattr(self, key))[:60]}; give a {names}")
        effects = list[Effect]()
        for effect in self.effects:
            if isinstance(effect, Effect):
                effects.append(effect)
            else:  # a text names one for each joint that matches
                name, values = parse_effect(effect)
                effects += [kind(joint, **values) for kind, joint in resolve([name], self.hand.joint_names)]
        if self.constants.joints != self.hand.joints:
            raise InputError(
                f"env.constants are of {self.constants.joints} joints, hand '{self.hand.name}' has {self.hand.joints}; "
                "take them from tactile_cube.simulation.constants_of(hand)"
            )
        if self.model is not None:
            model = as_model(self.model)
            known = identified(model, self.constants, self.randomization, self.hand.joint_names)
            for key, value in zip(("constants", "randomization"), known[:2], strict=True):
                object.__setattr__(self, key, value)
            effects += known[2]
            object.__setattr__(self, "model", None)
        object.__setattr__(self, "effects", effects)
        self.randomization.constants(self.constants, np.random.default_rng(0))  # refuses what cannot be drawn
        if not 1 <= self.stack <= DEEPEST_STACK:
            raise InputError(f"env.stack is {self.stack}; give 1 to {DEEPEST_STACK} readings")

    def approximations(self) -> list[str]:
        """Describe what is computed less accurately than it could be; [] if nothing."""
        drawn = self.randomization.values.get("tip_spinning_friction")
        largest = self.constants.tip_spinning_friction if drawn is None else float(drawn.quantile(np.array(ALMOST_ALL)))
        said = unresolved(largest, self.simulation)
        return [said] if said else []


def make_env(config: EnvConfig, worlds: int, seed: int, evaluation: bool = False) -> TransformedEnv:
    """Build the environment with batch size [worlds] and the keys "observation", "privileged" and "action".

    For a hand with 12 joints and a stack of 5 they have 120, 25 and 12 numbers.

    Args:
        config: what the environment is.
        worlds: number of worlds that this process hosts; with `simulation.engine` mixed, engines alternate among them.
        seed: seed of the worlds and of the transforms. Those draw from torch's global generator in training, where the
            actor's noise comes from it too, else from one of the environment's own.
        evaluation: the task itself, without extra exploration and curriculum; everything else stays as configured.

    Raises:
        InputError: fewer than one world.
    """
    if worlds < 1:
        raise InputError(f"number of worlds is {worlds}; give at least 1")
    poses = config.start.of(config.hand, config.constants)
    # processes, told apart by their seed, take turns in the engines too
    of_worlds = [replace(config, simulation=config.simulation.of_world(seed + index)) for index in range(worlds)]
    tasks = [rotation_env(one, poses) for one in of_worlds]
    kind = OwnGeneratorEnv if evaluation else TransformedEnv
    env = kind(WorldsEnv(tasks), Compose(*transforms(config, explore=not evaluation)))
    env.set_seed(seed)
    return env


def rotation_env(config: EnvConfig, poses: StartPoses | GraspTable | None = None) -> RotationEnv:
    """Make the task in one new world, without transforms; `poses` are the start poses, if already made."""
    world = World(config.hand, config.simulation, config.effects)
    start = config.start.of(config.hand, config.constants) if poses is None else poses
    return RotationEnv(world, config.task, config.reward, config.randomization, start, config.constants, config.hand)


def transforms(config: EnvConfig, explore: bool) -> list[Transform]:
    """Make the transforms, from the world to the policy: readings pass them downwards, actions upwards.

    Those for training alone, the first and the last, are included only with `explore`.
    """
    disturbances, hand = config.randomization, config.hand
    half_range = torch.tensor(0.5 * (hand.action_upper - hand.action_lower), dtype=torch.float32)
    scale = torch.tensor(OBJECT_SCALE + (1.0,) * hand.joints)
    chain: list[Transform] = [
        *([Curriculum(config.curriculum)] if explore else []),
        JointOffset(disturbances.joint_offset, half_range),
        SensorNoise(disturbances.sensor_noise),
        # the policy sees the two joint signals and nothing else; the first reading of an episode fills the whole stack
        CatTensors(["joint_position", "control_error"], "observation", sort=False),
        CatFrames(config.stack, -1, ["observation"]),
        # only the critics see the object
        RenameTransform(["object_state"], ["privileged"]),
        ObservationNorm(0.0, scale * float(config.privileged), ["privileged"]),
        StickyAction(disturbances.sticky_probability),
    ]
    if explore and config.exploration.extra > 0.0:
        size = (len(hand.fingers), hand.joints_per_finger)
        chain.append(FingerExploration(config.exploration, _demonstrated_gaits(config), *size))
    return chain


def _demonstrated_gaits(config: EnvConfig) -> torch.Tensor | None:
    """Return the actions (gaits, steps, joints) of whole episodes; None without demonstrations."""
    if config.exploration.demonstrations == 0.0:
        return None
    if config.exploration.gaits is None:
        raise InputError("exploration.demonstrations has no gaits; choose exploration=demonstrations")
    if config.task.axis_vector()[2] < 1.0:
        raise InputError(f"task.axis is {config.task.axis}: gaits turn about z; choose exploration=fingers or none")
    gaits = similar_gaits(
        config.hand, config.exploration.gaits, GAITS, config.task.episode_steps, config.task.direction
    )
    return torch.tensor(gaits, dtype=torch.float32)
