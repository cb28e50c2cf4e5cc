"""A model of a rig: constants of the drive, effects, and the joint offsets of each robot initialisation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.effects.effect import Array, Effect, Stage

EffectClass = type[Effect]


def effect_path(effect: EffectClass) -> str:
    """The name by which `find_effect` finds an effect: that of the catalogue, or the dotted path of a user's class."""
    known = effect.stage is Stage.CONTACT or catalogue().get(effect.name) is effect
    return effect.name if known else f"{effect.__module__}.{effect.__qualname__}"


def effect_label(effect: EffectClass, joint: str) -> str:
    """As a user writes it: `backlash@q2`, `my_rig.CableDrag@q2`, `lateral_friction`."""
    return effect_path(effect) if effect.stage is Stage.CONTACT else f"{effect_path(effect)}@{joint}"


@dataclass(frozen=True)
class Term:
    """An effect at a joint with values for all its parameters.

    Attributes:
        effect: its class.
        joint: where it acts.
        values: of all its parameters.
        fitted: those that a fit may change.
        expected: of a fitted one, what is known of it beforehand: centre and standard deviation.
    """

    effect: EffectClass
    joint: str
    values: Mapping[str, float]
    fitted: tuple[str, ...] = ()
    expected: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """As a user writes it."""
        return effect_label(self.effect, self.joint)


def terms_of(effects: Iterable[tuple[str, Mapping[str, float]]], joints: tuple[str, ...]) -> tuple[Term, ...]:
    """Effects given as (`NAME@JOINT` or `NAME`, parameter -> value); what is left out is typical.

    Raises:
        InputError: an unknown effect, joint or parameter.
    """
    return tuple(
        Term(effect, joint, effect(joint, **values).values)
        for name, values in effects
        for effect, joint in resolve([name], joints)
    )


@dataclass(frozen=True)
class Model:
    """What a simulation of a rig needs beside its URDF.

    Attributes:
        constants: kp, kd, torque_limit, stiffness, static_friction, reflected_inertia, friction_creep (how fast a
            sticking joint gives way, rad/s per N m) and reading_delay (how old a position is when its row is logged, s;
            negative: younger), each (n,).
        terms: effects in force.
        offsets: initialisation -> (n,) true minus measured angle [rad].
    """

    constants: Mapping[str, Array]
    terms: tuple[Term, ...]
    offsets: Mapping[int, Array]

    def with_offsets(self, known: Mapping[int, Array]) -> Model:
        """The model with these joint offsets [rad] in initialisations of which it has none."""
        return replace(self, offsets={**known, **self.offsets})
