"""Which property of fingertips or object a model lacks, judged on trials that the fit never saw."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelErrors, ModelFile
from tactile_cube.identification.contact.choice import GOOD, ContactSearch, Tried, mean_squares, some_of_each_kind
from tactile_cube.identification.contact.fit import fit_contact
from tactile_cube.identification.contact.trial import SIGMA, ContactTrial, open_grasps
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.comparison import Comparison, describe_comparison
from tactile_cube.measurement.comparing.error import ErrorSummary, summarise_errors
from tactile_cube.measurement.comparing.noise_floor import NoiseFloor
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import HandReplay, contact_of
from tactile_cube.measurement.replay.nominal import nominal_model, require_same_joints
from tactile_cube.measurement.replay.simulator import Simulated

Array = NDArray[np.float64]
Verdict = Literal["adequate", "missing_effect", "ambiguous", "unknown_effect"]
FITTED, JUDGED = 3, 2  # trials of each kind that are fitted and judged


@dataclass(frozen=True)
class ContactDiagnosis:
    """The answer.

    Attributes:
        verdict: the answer.
        found: effects that were added, in that order.
        rivals: what explains the last of them as well.
        tried: everything that was tried, best first in each round.
        estimates: (effect, parameter) -> value with interval.
        stages: nominal and with_effects: held-out errors [rad].
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
        held_out: names of the trials that judged.
    """

    verdict: Verdict
    found: list[Tried]
    rivals: list[Tried]
    tried: list[list[Tried]]
    estimates: dict[tuple[str, str], Estimate]
    stages: dict[str, ErrorSummary]
    noise_floor: float
    held_out: list[str]

    def effects(self) -> list[EffectEstimate]:
        """The recommended effects as the model file states them."""
        names = [one.effect.name for one in self.found] if self.verdict != "unknown_effect" else []
        grouped = {name: {p: e for (n, p), e in self.estimates.items() if n == name} for name in names}
        return [EffectEstimate(effect=name, parameters=values) for name, values in grouped.items()]

    def into(self, model: ModelFile, alone: bool) -> ModelFile:
        """The model with these effects; `alone`: nothing else was diagnosed, so its errors are these."""
        update: dict[str, Any] = {"effects": model.with_effects(self.effects())}
        if alone:
            overall: dict[str, Any] = {key: summary.overall for key, summary in self.stages.items()}
            update["errors"] = ModelErrors(**overall, noise_floor=self.noise_floor)
            others = [name for name in model.provenance.trials if name not in self.held_out]
            trials = {"trials": others, "held_out": self.held_out}
            update["provenance"] = model.provenance.model_copy(update=trials)
        return model.model_copy(update=update)

    def as_json(self) -> dict[str, Any]:
        """In the terms of diagnosis.json; errors in rad."""
        rivals = [one.effect.name for one in self.rivals]
        entries = [self._entry(one, rivals if one is self.found[-1] else []) for one in self.found]
        chosen = [one.effect.name for one in self.found[-1:]]
        entries += [self._entry(one, [*chosen, *(r for r in rivals if r != one.effect.name)]) for one in self.rivals]
        overall = {key: summary.overall for key, summary in self.stages.items()}
        return {
            "verdict": self.verdict,
            "effects": entries if self.verdict in ("missing_effect", "ambiguous") else [],
            "unexplained_joints": [],
            "ranking": [
                {
                    "effects": one.effect.name,
                    "held_out_error": one.error,
                    "gain": one.gain,
                    "p_value": one.p_value,
                    "gain_of": one.gain_of,
                }
                for tried in self.tried
                for one in tried
            ],
            # grasps refit no constants of the drives: the stated error stands for the refitted one
            "error": overall | {"refitted": overall["nominal"], "noise_floor": self.noise_floor},
            "error_joints": {key: summary.joints for key, summary in self.stages.items()},
            "noise_floor_source": "contact",
            "unexplained": [],
            "partial_effects": entries if self.verdict == "unknown_effect" else [],
            "next_experiment": None,
            "held_out": self.held_out,
        }

    def _entry(self, one: Tried, rivals: list[str]) -> dict[str, Any]:
        coarse = {p.name: Estimate(value=v, low=p.low, high=p.high, unit=p.unit) for p, v in _values(one)}
        exact = {p: e for (name, p), e in self.estimates.items() if name == one.effect.name}
        return {
            "name": one.effect.name,
            "joints": ["object"],
            "parameters": {key: e.model_dump() for key, e in (coarse | exact).items()},
            "heldout_gain": one.gain,
            "gain_of": one.gain_of,
            "p_value": one.p_value,
            "rivals": rivals,
        }


def diagnose_contact(
    recording: Recording,
    model: ModelFile | None = None,
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
) -> ContactDiagnosis:
    """Add contact effects one after another while the held-out error falls, the drivetrain taken as known.

    Args:
        recording: trials without an object are left aside.
        model: of the drivetrain; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
        say: takes progress lines.
    """
    with open_grasps(recording, model, step, seed) as grasps:
        trials = some_of_each_kind(grasps.fitted, FITTED)
        validation = some_of_each_kind(grasps.held_out, JUDGED)
        search = ContactSearch(trials, validation, say)
        search.run(grasps.start)
        estimates, end = {}, search.first
        if search.found:
            fit = fit_contact(trials, [one.effect for one in search.found], grasps.start, say)
            estimates, end = fit.estimates, mean_squares(validation, fit.contact)
    errors = {"nominal": search.first, "with_effects": end}
    stages = {key: summarise_errors(list(np.sqrt(squares)), grasps.joints) for key, squares in errors.items()}
    names = [one.trial.name for one in validation]
    verdict = verdict_of(search, stages["with_effects"].overall)
    return ContactDiagnosis(
        verdict, search.found, search.rivals, search.tried, estimates, stages, grasps.noise_floor, names
    )


def with_contact(result: Mapping[str, Any], found: ContactDiagnosis) -> dict[str, Any]:
    """The content of diagnosis.json of a drivetrain, with what was found of fingertips and object.

    The errors stay those of free motion; those of the grasps stand under `contact`.
    """
    contact = found.as_json()
    verdicts = (result["verdict"], contact["verdict"])
    return {
        **result,
        "verdict": next(
            one for one in ("unknown_effect", "ambiguous", "missing_effect", "adequate") if one in verdicts
        ),
        "effects": [*result["effects"], *contact["effects"]],
        "partial_effects": [*result["partial_effects"], *contact["partial_effects"]],
        "contact": contact,
    }


def verdict_of(search: ContactSearch, left: float) -> Verdict:
    """The answer, with `left` of the held-out error [rad]."""
    if not search.found:
        return "adequate" if left < 2 * GOOD else "unknown_effect"
    return "ambiguous" if search.rivals else "missing_effect"


def _values(one: Tried) -> list[tuple[Any, float]]:
    values: Mapping[str, float] = one.contact.values.get(one.effect.name, {})
    pairs = [(p, values.get(p.name, p.neutral)) for p in one.effect.parameters]
    return [(p, float(np.clip(value, p.low, p.high))) for p, value in pairs]


def compare_contact(
    recording: Recording, model: ModelFile | None = None, step: float = 0.002, say: Callable[[str], None] = print
) -> Comparison:
    """Simulate every trial with an object in the world that training uses.

    Each trial has the joint offsets and the place of the object that suit it.

    Args:
        recording: trials without an object are left aside.
        model: of drivetrain, fingertips and object; None: as recording.yaml states them.
        step: longest physics step [s].
        say: takes progress lines.
    """
    held = with_object(recording)
    if model is not None:
        require_same_joints(held, model)
    replay, contact = HandReplay(held, nominal_model(held, model), step), contact_of(model)
    simulated = []
    try:
        for number, trial in enumerate(held.trials, start=1):
            position = trial.position - ContactTrial(replay, trial).residual(contact)
            simulated.append(Simulated(position, np.full_like(position, np.nan)))
            say(f"{trial.name} simulated, {number} of {len(held.trials)}")
    finally:
        replay.close()
    floor = NoiseFloor(SIGMA, dict.fromkeys(held.joints, SIGMA), "contact", 0, {})
    return describe_comparison(held, model, simulated, floor, None, step)
