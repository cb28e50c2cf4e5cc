"""Protocols of an evaluation: number and length of episodes, and changes of the world."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.env import RotationEnv
from tactile_cube.errors import InputError
from tactile_cube.evaluation.episode_record import Array
from tactile_cube.evaluation.policies import Policy
from tactile_cube.hand import DLR_HAND2, Hand
from tactile_cube.simulation import EpisodeConstants, SimulationOptions
from tactile_cube.transforms import EnvConfig

UNCHANGED = "worlds as drawn"  # name of the condition in which worlds and starts stay as drawn
CHANGEABLE = {"constants": EpisodeConstants, "simulation": SimulationOptions}


class NumbPolicy:
    """Policy whose senses are partly frozen at the first observation of the episode."""

    def __init__(self, policy: Policy, numb: Sequence[str], hand: Hand = DLR_HAND2) -> None:
        self._policy, self._numb = policy, numb_reading(numb, hand)

    def start(self, env: RotationEnv, seed: int) -> None:
        """Begin an episode."""
        self._policy.start(env, seed)

    def act(self, observation: NDArray[np.float32], step: int) -> Array:
        """Return the policy's action for what it still feels."""
        if step == 0:
            self._first = observation.copy()
        numb = np.tile(self._numb, len(observation) // len(self._numb))
        return self._policy.act(np.where(numb, self._first, observation), step)


def numb_reading(numb: Sequence[str], hand: Hand = DLR_HAND2) -> NDArray[np.bool_]:
    """Return which of the numbers of a reading are frozen: measured angles, control errors, all of one finger's.

    Raises:
        InputError: there is no such sense.
    """
    places = np.arange(2 * hand.joints)
    finger = places % hand.joints // hand.joints_per_finger
    senses = {"q_m": places < hand.joints, "e_q": places >= hand.joints}
    senses |= {one.name: finger == index for index, one in enumerate(hand.fingers)}
    for name in numb:
        if name not in senses:
            raise InputError(f"variant.numb has {name!r}; choose from {', '.join(senses)}")
    return np.isin(places, [place for name in numb for place in np.flatnonzero(senses[name])])


@dataclass(frozen=True)
class Pull:
    """A force on one fingertip, as when somebody pulls at the finger.

    Attributes:
        finger: its name, of the DLR-Hand II ring, middle, fore or thumb.
        force: away from the cube's axis, horizontally [N].
        start: when it begins [s].
        duration: how long it lasts [s].
    """

    finger: str
    force: float
    start: float = 3.0
    duration: float = 1.0

    def __call__(self, env: RotationEnv, step: int) -> None:
        """Pull, or let go, before the policy step that comes."""
        finger, time = self.check(env.hand), step * env.world.options.policy_dt
        tip = env.world.tip_positions[finger]
        outward = tip * [1.0, 1.0, 0.0] / np.linalg.norm(tip[:2])
        acting = self.start <= time < self.start + self.duration
        env.world.pull_finger(finger, self.force * outward if acting else np.zeros(3))

    def check(self, hand: Hand) -> int:
        """Return the finger's index. Raises InputError: the hand has no such finger."""
        fingers = [finger.name for finger in hand.fingers]
        if self.finger not in fingers:
            raise InputError(f"pull.finger is {self.finger!r}; choose one of {', '.join(fingers)}")
        return fingers.index(self.finger)


@dataclass(frozen=True)
class Variant:
    """One condition of a protocol.

    Attributes:
        name: label in tables.
        axis: what is varied, e.g. "cube size [mm]"; variants of one axis form a line of the robustness map.
        value: the number on that axis.
        constants: replaced constants of the episode (fields of EpisodeConstants); their randomisation is centred on
            the new value, or dropped where it would have replaced it.
        simulation: replaced options of the world (fields of SimulationOptions).
        effects: effects of the drivetrain, by catalogue name or dotted path, at their typical size on every joint.
        pull: a pull at a finger, or none.
        numb: senses of the policy that are frozen at the start: q_m, e_q, or a finger's name for all of that finger.
    """

    name: str = UNCHANGED
    axis: str = ""
    value: float = 0.0
    constants: Mapping[str, Any] = field(default_factory=dict)
    simulation: Mapping[str, Any] = field(default_factory=dict)
    effects: tuple[str, ...] = ()
    pull: Pull | None = None
    numb: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse unknown constants and options."""
        for group, kind in CHANGEABLE.items():
            known = [one.name for one in dataclasses.fields(kind)]
            for key in getattr(self, group):
                if key not in known:
                    raise InputError(f"variant {self.name}: {group}.{key} is unknown; choose from {', '.join(known)}")

    def apply(self, config: EnvConfig) -> EnvConfig:
        """Return the environment with this change.

        Raises:
            InputError: the hand has no such finger or sense.
        """
        numb_reading(self.numb, config.hand)
        if self.pull is not None:
            self.pull.check(config.hand)
        constants: dict[str, Any] = {
            key: tuple(map(float, v)) if hasattr(v, "__iter__") else v for key, v in self.constants.items()
        }
        values = {key: value for key, value in config.randomization.values.items() if key not in constants}
        return dataclasses.replace(
            config,
            constants=dataclasses.replace(config.constants, **constants),
            randomization=dataclasses.replace(config.randomization, values=values),
            simulation=dataclasses.replace(config.simulation, **self.simulation),
            effects=[*config.effects, *self.effects],
        )


@dataclass(frozen=True)
class Protocol:
    """Protocol of an evaluation, as in a file of conf/protocol.

    Attributes:
        name: label in tables and files.
        episodes: number of episodes per variant.
        seconds: time limit of an episode [s]; None: the task's own.
        worlds: whose randomisation and starts: of the policy's "training", or of the "paper".
        variants: conditions, each tried with the same seeds.
        nominal_values: where the nominal condition lies on the axes of the variants.
        catalogue: add a variant for each effect of the drivetrain's catalogue at its typical size.
        numb_fingers: add a variant for each finger of the hand, whose senses are frozen.
        replay: standard deviations of the start's displacement [m]; at each, the targets of the policy's best
            episode are replayed in its world, and the policy is tried there.
        film: number of episodes, the best first, that are filmed and recorded for Rerun.
        trace: keep the signals of every physics step in the recorded episodes.
    """

    name: str
    episodes: int = 20
    seconds: float | None = None
    worlds: str = "training"
    variants: Sequence[Variant] = field(default_factory=lambda: (Variant(),))
    nominal_values: Mapping[str, float] = field(default_factory=dict)
    catalogue: bool = False
    numb_fingers: bool = False
    replay: Sequence[float] = ()
    film: int = 1
    trace: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        for key, sound, wanted in (
            ("episodes", self.episodes >= 1, "give at least 1"),
            ("seconds", self.seconds is None or self.seconds > 0, "give a time above 0 s or null"),
            ("worlds", self.worlds in ("training", "paper"), "choose training or paper"),
            ("variants", bool(self.variants), "give at least one, {name: worlds as drawn}"),
            ("replay", all(0.0 <= one < 0.05 for one in self.replay), "give displacements from 0 to below 0.05 m"),
            ("film", self.film >= 0, "give 0 or more"),
        ):
            if not sound:
                raise InputError(f"protocol.{key} is {getattr(self, key)!r}; {wanted}")

    def conditions(self, hand: Hand = DLR_HAND2) -> tuple[Variant, ...]:
        """Return all variants, those of the hand's fingers and of the catalogue included."""
        numb = [finger.name for finger in hand.fingers if self.numb_fingers]
        effects = catalogue() if self.catalogue else ()
        return (
            *self.variants,
            *(Variant(name=f"{finger} numb", numb=(finger,)) for finger in numb),
            *(Variant(name=effect.replace("_", " "), effects=(effect,)) for effect in effects),
        )
