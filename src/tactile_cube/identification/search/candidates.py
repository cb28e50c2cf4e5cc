"""What may be missing: every effect in every form, and models with simpler, richer, fewer or other ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from tactile_cube.drivetrain.effects.effect import Effect, Parameter
from tactile_cube.drivetrain.effects.scales import FINGER, Scales
from tactile_cube.identification.fitting.unknowns import Unknown
from tactile_cube.measurement.replay.model import Model, Term

EffectClass = type[Effect]
Sizes = Mapping[str, Scales]
"""Joint -> its sizes; a joint that is not there counts as a finger's."""
UNKNOWN = (0.0, math.inf)  # centre and standard deviation of a number of which nothing is known
MOST_SHOWN = 4  # fitted parameters that a label lists
NO_SIZE = 1e6  # a limit so far off, in the units of a finger, is none


@dataclass(frozen=True)
class Candidate:
    """One effect in one form at one or more joints.

    Attributes:
        effect: its class.
        joints: where it acts.
        form: parameters that are fitted, and their starts at the first joint; at others as much of their size.
        sizes: of the joints.
    """

    effect: EffectClass
    joints: tuple[str, ...]
    form: Mapping[str, float]
    sizes: Sizes = field(default_factory=dict, repr=False, compare=False)

    @property
    def label(self) -> str:
        """Readable and unique: `backlash(play)@q2`."""
        fitted = ", ".join(self.form) if len(self.form) <= MOST_SHOWN else f"{len(self.form)} values"
        return f"{self.effect.name}({fitted})@{'+'.join(self.joints)}"

    @property
    def size(self) -> int:
        """Fitted numbers."""
        return len(self.form) * len(self.joints)

    def parameters(self, joint: str) -> dict[str, Parameter]:
        """All parameters of the effect with their sizes at a joint."""
        return self.effect.parameters_at(self.sizes.get(joint, FINGER))

    def start(self, joint: str) -> dict[str, float]:
        """The form's starts at a joint."""
        here, first = (self.sizes.get(one, FINGER) for one in (joint, self.joints[0]))
        units = {p.name: p.unit for p in self.effect.parameters}
        return {name: value * here.of(units[name]) / first.of(units[name]) for name, value in self.form.items()}

    def added_to(self, model: Model) -> tuple[Model, tuple[Unknown, ...]]:
        """The model with the effect at its start, and the unknowns that this adds."""
        terms = [self._term(joint) for joint in self.joints]
        first = len(model.terms)
        unknowns = tuple(u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, self.sizes))
        return replace(model, terms=(*model.terms, *terms)), unknowns

    def _term(self, joint: str) -> Term:
        scales = self.sizes.get(joint, FINGER)
        neutral = {name: p.neutral for name, p in self.parameters(joint).items()}
        values = neutral | self.effect.placed_at(scales) | self.start(joint)
        return Term(self.effect, joint, values, tuple(self.form))


def term_unknowns(term: Term, place: int, sizes: Sizes | None = None) -> tuple[Unknown, ...]:
    """The unknowns of a term; where a parameter does not say otherwise, the size of its value is the scale."""
    joint = (sizes or {}).get(term.joint, FINGER)
    parameters = term.effect.parameters_at(joint)
    known = {name: abs(term.values[name]) for name in term.fitted}
    known = {n: size if size < NO_SIZE * joint.of(parameters[n].unit) else 0.0 for n, size in known.items()}
    scales = {name: known[name] or abs(parameters[name].typical) for name in term.fitted}
    fallback = max([size for size in scales.values() if size > 0.0], default=1.0)
    return tuple(
        Unknown(
            "effect",
            name,
            place,
            p.low,
            p.high,
            p.scale or scales[name] or fallback,
            neutral=p.neutral,
            centre=term.expected.get(name, UNKNOWN)[0],
            spread=term.expected.get(name, UNKNOWN)[1],
        )
        for name, p in ((name, parameters[name]) for name in term.fitted)
    )


def model_unknowns(model: Model, sizes: Sizes | None = None) -> tuple[Unknown, ...]:
    """The unknowns of all effects that a model has."""
    return tuple(u for place, term in enumerate(model.terms) for u in term_unknowns(term, place, sizes))


def forms(effect: EffectClass) -> list[dict[str, float]]:
    """The forms of an effect at a finger's joint."""
    return effect.forms_at(FINGER)


def candidates(sizes: Sizes, effects: Sequence[EffectClass]) -> list[Candidate]:
    """Every effect in every form at every single joint where it can act; none that starts from the residual."""
    return [
        Candidate(effect, (joint,), start, sizes)
        for effect in effects
        for joint, scales in sizes.items()
        if effect.can_act(scales)
        for start in effect.starts_at(scales)
        if not set(effect.from_residual) & set(start)
    ]


def with_details(candidate: Candidate, model: Model) -> tuple[Candidate, Model, tuple[Unknown, ...]] | None:
    """The last effect of a fitted model with the details of its law free too: as candidate, model and unknowns.

    None for a law of which the recording can tell no details that are not fitted already.

    Args:
        candidate: the last effect.
        model: fitted.
    """
    first = len(model.terms) - len(candidate.joints)
    scales = candidate.sizes.get(candidate.joints[0], FINGER)
    told = candidate.effect.details_at(scales, model.terms[first].values)
    details = [name for name in told if name not in candidate.form]
    if not details:
        return None
    neutral = {name: p.neutral for name, p in candidate.parameters(candidate.joints[0]).items() if name in details}
    terms = [replace(term, fitted=(*term.fitted, *details)) for term in model.terms[first:]]
    unknowns = [u for k, term in enumerate(terms) for u in term_unknowns(term, first + k, candidate.sizes)]
    detailed = replace(candidate, form={**candidate.form, **neutral})
    return detailed, replace(model, terms=(*model.terms[:first], *terms)), tuple(unknowns)


def first_term(model: Model, effects: Sequence[Candidate], place: int) -> int:
    """Which of a model's terms, the last of which are those of `effects`, is the first one of an effect."""
    known = len(model.terms) - sum(len(candidate.joints) for candidate in effects)
    return known + sum(len(candidate.joints) for candidate in effects[:place])


def without_effect(model: Model, effects: Sequence[Candidate], place: int) -> Model:
    """A fitted model, whose last terms are those of `effects`, without one of them."""
    first = first_term(model, effects, place)
    return replace(model, terms=(*model.terms[:first], *model.terms[first + len(effects[place].joints) :]))
