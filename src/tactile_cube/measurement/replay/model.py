"""Model of a rig: constants, effects, joint offsets; the nominal one, that of a file, draws from its intervals."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from tactile_cube.drivetrain.effects import resolve
from tactile_cube.drivetrain.effects.catalogue import catalogue
from tactile_cube.drivetrain.effects.effect import Array, Effect, Stage
from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.measurement.joint_scales import joint_scales
from tactile_cube.measurement.recordings.consistency import DEFAULTS, EFFECTS
from tactile_cube.measurement.recordings.recording import Recording

EffectClass = type[Effect]


def effect_path(effect: EffectClass) -> str:
    """Return the name by which `find_effect` finds an effect: of the catalogue, or a user class's dotted path."""
    known = effect.stage is Stage.CONTACT or catalogue().get(effect.name) is effect
    return effect.name if known else f"{effect.__module__}.{effect.__qualname__}"


def effect_label(effect: EffectClass, joint: str) -> str:
    """Return the label as a user writes it: `backlash@q2`, `my_rig.CableDrag@q2`, `lateral_friction`."""
    return effect_path(effect) if effect.stage is Stage.CONTACT else f"{effect_path(effect)}@{joint}"


@dataclass(frozen=True)
class Term:
    """An effect at a joint with values for all its parameters."""

    effect: EffectClass
    joint: str  # where it acts
    values: Mapping[str, float]  # of all its parameters
    fitted: tuple[str, ...] = ()  # those that a fit may change
    # of a fitted one, what is known of it beforehand: centre and standard deviation
    expected: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """As a user writes it."""
        return effect_label(self.effect, self.joint)


def terms_of(effects: Iterable[tuple[str, Mapping[str, float]]], joints: tuple[str, ...]) -> tuple[Term, ...]:
    """Return effects given as (`NAME@JOINT` or `NAME`, parameter -> value); what is left out is typical.

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
    """What a simulation of a rig needs beside its URDF."""

    # kp, kd, torque_limit, stiffness, static_friction, reflected_inertia, friction_creep (how fast a sticking joint
    # gives way, rad/s per N m) and reading_delay (how old a position is when its row is logged, s; negative: younger),
    # each (n,)
    constants: Mapping[str, Array]
    terms: tuple[Term, ...]  # effects in force
    offsets: Mapping[int, Array]  # initialisation -> (n,) true minus measured angle [rad]

    def with_offsets(self, known: Mapping[int, Array]) -> Self:
        """Return the model with these joint offsets [rad] in initialisations for which it has none."""
        return replace(self, offsets={**known, **self.offsets})


STATED = 0.5  # part by which a stated effect may be wrong: damping is copied from one model to the next
CONTROLLER = ("kp", "kd", "torque_limit")
TORQUE_MODE_GAIN = 1e-6  # [N m/rad] a commanded torque u is the position u / gain at this gain


def nominal_model(recording: Recording, known: ModelFile | None = None) -> Model:
    """Build the model of the owner's values or those in `known`; effect parameters with an interval are free.

    Their prior is centred at the known value and twice as wide as the interval states: a machine changes between two
    recordings. Without this prior, known effects would absorb what is new in another recording.
    """
    constants = {key: np.array([one.value for one in row]) for key, row in _estimates(recording, known).items()}
    terms = []
    for one in _effects(recording, known):
        given = {name: estimate.value for name, estimate in one.parameters.items()}
        free = tuple(name for name, estimate in one.parameters.items() if estimate.high > estimate.low)
        expected = {name: (e.value, 0.5 * (e.high - e.low)) for name, e in one.parameters.items() if name in free}
        try:
            placed = [(kind, joint, kind(joint, **given)) for kind, joint in resolve([one.effect], recording.joints)]
        except InputError as error:
            raise InputError(f"model: {error}") from None
        terms += [Term(kind, joint, effect.values, free, expected) for kind, joint, effect in placed]
    return Model(constants, tuple(terms), no_offsets(recording))


def no_offsets(recording: Recording) -> dict[int, Array]:
    """Return no joint offset in any initialisation."""
    return {trial.initialisation: np.zeros(len(recording.joints)) for trial in recording.trials}


def draw_model(
    recording: Recording, known: ModelFile | None, spread: Mapping[str, float], rng: np.random.Generator
) -> Model:
    """Draw one randomised model about the owner's values; parameters with an interval in `known` are drawn from it.

    `spread` has the relative half widths of constants without an interval; its `offset` is that of joint offsets [rad].
    """
    constants = {
        key: np.array([_drawn(one, spread.get(key, 0.0), rng) for one in row])
        for key, row in _estimates(recording, known).items()
    }
    effects = [
        (one.effect, {key: _drawn(value, 0.0, rng) for key, value in one.parameters.items()})
        for one in _effects(recording, known)
    ]
    width, offsets = spread.get("offset", 0.0), known.offsets if known is not None else {}
    bounds = [(offsets[j].low, offsets[j].high) if j in offsets else (-width, width) for j in recording.joints]
    offset = -np.array([rng.uniform(low, high) for low, high in bounds])
    return Model(constants, terms_of(effects, recording.joints), dict.fromkeys(no_offsets(recording), offset))


def _effects(recording: Recording, known: ModelFile | None) -> list[EffectEstimate]:
    if known is not None:
        return known.drive_effects
    return _unknown_masses(recording) + [
        EffectEstimate(
            effect=f"{effect}@{joint}",
            parameters={parameter: Estimate(value=v, low=(1.0 - STATED) * v, high=(1.0 + STATED) * v)},
        )
        for effect, parameter in EFFECTS.items()
        for joint, v in zip(recording.joints, recording.nominal.get(effect, np.zeros(0)), strict=False)
        if v > 0.0
    ]


def _unknown_masses(recording: Recording) -> list[EffectEstimate]:
    """Return the masses of links that are guesses: more or less where they are now, by as much as they are or less."""
    if "mass" not in recording.description.unknown:
        return []
    found = []
    for joint, one in zip(recording.joints, joint_scales(recording), strict=True):
        mass = Estimate(value=0.0, low=-one.mass, high=one.mass)
        parameters = {"mass": mass, "distance": Estimate.model_validate(one.lever)}
        found.append(EffectEstimate(effect=f"payload@{joint}", parameters=parameters))
    return found


def _drawn(estimate: Estimate, spread: float, rng: np.random.Generator) -> float:
    """Draw uniformly in the interval, or within the relative spread where there is none."""
    if not np.isfinite(estimate.value):
        return estimate.value
    if estimate.high > estimate.low:
        return float(rng.uniform(estimate.low, estimate.high))
    return estimate.value * float(rng.uniform(1 - spread, 1 + spread))


def _estimates(recording: Recording, known: ModelFile | None) -> dict[str, list[Estimate]]:
    believed = {key: getattr(recording.gains, key) for key in CONTROLLER}
    if recording.torque_controlled:
        back_emf = recording.gains.kd * (recording.description.controller.mode == "voltage")
        believed |= {"kp": np.full(len(recording.joints), TORQUE_MODE_GAIN), "kd": back_emf}
    for key, value in DEFAULTS.items():
        believed[key] = recording.nominal.get(key, np.full(len(recording.joints), value))
    rows = {key: [Estimate(value=float(v), low=float(v), high=float(v)) for v in row] for key, row in believed.items()}
    for key, by_joint in (known.values if known is not None else {}).items():
        if key not in rows:
            raise InputError(f"model: key 'values.{key}': not a constant of the drivetrain; known: {sorted(rows)}")
        for index, joint in enumerate(recording.joints):
            rows[key][index] = by_joint.get(joint, rows[key][index])
    return rows


def require_same_joints(recording: Recording, model: ModelFile) -> None:
    """Refuse, by an InputError, a model whose joints are not the recording's."""
    if set(model.joints) != set(recording.joints):
        raise InputError(f"model: joints {model.joints} are not those of the recording, {list(recording.joints)}")
