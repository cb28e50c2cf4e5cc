"""How a policy is tried: how many episodes, how long, and under which conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.errors import InputError
from tactile_cube.evaluation.variant import Variant


@dataclass(frozen=True)
class Protocol:
    """A protocol, one file of conf/protocol each.

    Attributes:
        name: label in tables and files.
        episodes: number of episodes per variant.
        seconds: time limit of an episode [s]; None: the task's own.
        worlds: whose randomisation and starts: of the policy's "training", or of the "paper".
        variants: conditions, each tried with the same seeds.
        nominal_values: where the nominal condition lies on the axes of the variants.
        catalogue: add a variant for each effect of the drivetrain's catalogue at its typical size.
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
    replay: Sequence[float] = ()
    film: int = 1
    trace: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        if self.episodes < 1:
            raise InputError(f"protocol.episodes is {self.episodes}; give at least 1")
        if self.seconds is not None and not self.seconds > 0:
            raise InputError(f"protocol.seconds is {self.seconds}; give a time above 0 s or null")
        if self.worlds not in ("training", "paper"):
            raise InputError(f"protocol.worlds is {self.worlds!r}; choose training or paper")
        if not self.variants:
            raise InputError("protocol.variants is empty; give at least one, {name: worlds as drawn}")
        if not all(0.0 <= spread < 0.05 for spread in self.replay):
            raise InputError(f"protocol.replay is {list(self.replay)}; give displacements from 0 to below 0.05 m")
        if self.film < 0:
            raise InputError(f"protocol.film is {self.film}; give 0 or more")

    @property
    def conditions(self) -> tuple[Variant, ...]:
        """All variants, those of the catalogue included."""
        if not self.catalogue:
            return tuple(self.variants)
        return (*self.variants, *(Variant(name=effect.replace("_", " "), effects=(effect,)) for effect in catalogue()))
