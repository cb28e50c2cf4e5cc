"""Joint offsets that do not change between robot initialisations: an encoder whose zero is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from tactile_cube.drivetrain.effects.effect import Effect
from tactile_cube.identification.search.candidates import Candidate, Sizes
from tactile_cube.identification.search.explanation import Explanation
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Model, Term

Array = NDArray[np.float64]
LEAST = 0.012  # [rad] of a finger: joint offsets below this are ordinary
UNLIKELY = 0.001  # probability, over all joints, of such offsets by initialising alone at which they are still ordinary
STRIKING, DOUBTFUL = 0.03, 0.1  # [rad] of a finger, and probability from which on they are worth a word


@dataclass(frozen=True)
class CommonOffset:
    """A joint offset that is much the same in every initialisation.

    Attributes:
        joint: its name.
        offset: mean, as position_offset counts it [rad].
        initialisations: how many agree.
        by_chance: probability of such agreement by initialising alone.
    """

    joint: str
    offset: float
    initialisations: int
    by_chance: float


def shared_offset(
    base: Explanation, fitted: Recording, effects: Sequence[type[Effect]], sizes: Sizes
) -> Explanation | None:
    """The base model with the offsets that all initialisations share as an effect; None if there are none.

    A joint offset that differs between initialisations is what initialising does, and no error of the model. Two or
    three initialisations whose offsets happen to be alike are no evidence either: Student's t decides.
    """
    effect = next((effect for effect in effects if effect.constant_reading), None)
    if effect is None or len(base.judgement.model.offsets) < 2:
        return None
    mean, by_chance = _mean_and_chance(base, sizes)
    least = LEAST * np.array([sizes[joint].of("rad") for joint in fitted.joints])
    shared = (np.abs(mean) > least) & (by_chance < UNLIKELY)
    if not shared.any():
        return None
    places = np.flatnonzero(shared)
    joints = tuple(fitted.joints[j] for j in places)
    name = effect.constant_reading
    terms = tuple(Term(effect, fitted.joints[j], {name: float(mean[j])}, (name,)) for j in places)
    offsets = {key: value + np.where(shared, mean, 0.0) for key, value in base.fit.model.offsets.items()}
    model = Model(base.fit.model.constants, (*base.fit.model.terms, *terms), offsets)
    candidate = Candidate(effect, joints, {name: float(np.abs(mean[shared]).max())}, sizes)
    fit = replace(base.fit, model=model)
    return replace(base, effects=(*base.effects, candidate), fit=fit, p_value=float(by_chance[shared].max()), gain=1.0)


def common_offsets(base: Explanation, sizes: Sizes) -> tuple[CommonOffset, ...]:
    """Large offsets that every initialisation has and that two or three of them do not prove to be the encoder's."""
    count = len(base.judgement.model.offsets)
    if count < 2:
        return ()
    mean, by_chance = _mean_and_chance(base, sizes)
    return tuple(
        CommonOffset(joint, float(mean[j]), count, float(by_chance[j]))
        for j, (joint, scales) in enumerate(sizes.items())
        if abs(mean[j]) > STRIKING * scales.of("rad") and UNLIKELY <= by_chance[j] < DOUBTFUL
    )


def _mean_and_chance(base: Explanation, sizes: Sizes) -> tuple[Array, Array]:
    """Mean offsets (n,) over the initialisations, and how probable their likeness is (Student's t).

    The joints of a machine are initialised in one way, so what their offsets scatter by, each in its own scale, is one
    number that all of them tell: three initialisations of a single joint say little. Where a joint's own scatter is
    larger it counts.
    """
    scale = np.array([one.of("rad") for one in sizes.values()])
    offsets = -np.array([base.judgement.model.offsets[k] for k in sorted(base.judgement.model.offsets)]) / scale
    mean, variance = offsets.mean(axis=0), offsets.var(axis=0, ddof=1)
    scatter = np.sqrt(np.maximum(variance, variance.mean()))
    ratio = np.abs(mean) / np.maximum(scatter, 1e-9) * np.sqrt(len(offsets))
    freedom = (len(offsets) - 1) * len(mean)
    return mean * scale, np.minimum(1.0, 2.0 * student_t.sf(ratio, freedom) * len(mean))
