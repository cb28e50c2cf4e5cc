"""Identify effects of fingertips and object from the trials in which the hand holds one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelErrors, ModelFile
from tactile_cube.errors import InputError
from tactile_cube.identification.contact.fit import ContactFit, fit_contact, shown_by
from tactile_cube.identification.contact.trial import ContactTrial, open_grasps
from tactile_cube.measurement.bench import with_object
from tactile_cube.measurement.comparing.error import ErrorSummary, summarise_errors
from tactile_cube.measurement.recordings.reading import DESCRIPTION
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.simulation.contact_effects import ContactEffect, contact_catalogue, is_contact_effect


@dataclass(frozen=True)
class ContactIdentification:
    """Contact effects with intervals, and what they gain.

    Attributes:
        fit: values, intervals and what each initialisation said.
        stages: nominal and with_effects: errors on held-out trials, offsets and the box's place fitted to each [rad].
        noise_floor: noise of the position sensors, and what a world with the true effects leaves [rad].
        held_out: names of the held-out trials.
    """

    fit: ContactFit
    stages: dict[str, ErrorSummary]
    noise_floor: float
    held_out: list[str]

    def into(self, model: ModelFile, alone: bool) -> ModelFile:
        """The model with these effects; `alone`: nothing else was identified, so its errors are these."""
        effects = model.with_effects(self.effects())
        if not alone:
            return model.model_copy(update={"effects": effects})
        joints = {key: summary.joints for key, summary in self.stages.items()}
        errors = ModelErrors(**self.errors, joints=joints)
        fitted = [name for name in model.provenance.trials if name not in self.held_out]
        provenance = model.provenance.model_copy(update={"trials": fitted, "held_out": self.held_out})
        return model.model_copy(update={"effects": effects, "errors": errors, "provenance": provenance})

    @property
    def errors(self) -> dict[str, float]:
        """The error of each stage, and the noise floor [rad]."""
        return {key: one.overall for key, one in self.stages.items()} | {"noise_floor": self.noise_floor}

    def effects(self) -> list[EffectEstimate]:
        """As the model file states them."""
        parameters: dict[str, dict[str, Estimate]] = {}
        for (effect, parameter), estimate in self.fit.estimates.items():
            parameters.setdefault(effect, {})[parameter] = estimate
        return [EffectEstimate(effect=name, parameters=values) for name, values in parameters.items()]

    def as_json(self) -> dict[str, Any]:
        """Plain numbers, errors in rad."""
        return {
            "effects": [one.model_dump() for one in self.effects()],
            "error": self.errors,
            "joints": {key: one.joints for key, one in self.stages.items()},
            "held_out": self.held_out,
            "initialisations": {
                " ".join(key): [vars(one) for one in said] for key, said in self.fit.by_initialisation.items()
            },
            "silent": self.fit.silent(),
        }


def contact_effects(names: Sequence[str], recording: Recording) -> list[type[ContactEffect]]:
    """The contact effects among names as a user writes them.

    Raises:
        InputError: one with a joint, or with a recording that has no object.
    """
    chosen = [name for name in names if is_contact_effect(name)]
    for name in chosen:
        if "@" in name:
            raise InputError(
                f"effects: '{name}': {name.partition('@')[0]} belongs to fingertips and object, not to a joint; "
                "leave out what follows the @"
            )
        if not with_object(recording).trials:
            raise InputError(
                f"effects: '{name}' shows only where the hand holds something, and no trial of "
                f"{recording.folder / DESCRIPTION} has a key 'object'; record such trials "
                "(python -m tactile_cube.record source=grasp simulates them) or leave the effect out"
            )
    return [contact_catalogue()[name] for name in dict.fromkeys(chosen)]


def identify_contact(
    recording: Recording,
    effects: Sequence[type[ContactEffect]],
    model: ModelFile | None = None,
    step: float = 0.002,
    seed: int = 0,
    say: Callable[[str], None] = print,
) -> ContactIdentification:
    """Fit contact effects by simulation in the world that training uses, the drivetrain taken as known.

    Args:
        recording: trials without an object are left aside.
        effects: what to fit.
        model: of the drivetrain; None: as recording.yaml states it.
        step: longest physics step [s].
        seed: which trials are held out.
        say: takes progress lines.
    """
    with open_grasps(recording, model, step, seed) as grasps:
        fit = fit_contact(grasps.fitted, effects, grasps.start, say)
        say("simulating the held-out trials")
        validation = list(dict.fromkeys(one for effect in effects for one in shown_by(grasps.held_out, effect)))
        stages = {"nominal": grasps.start, "with_effects": fit.contact}
        errors = {key: _error(validation, contact, grasps.joints) for key, contact in stages.items()}
    return ContactIdentification(fit, errors, grasps.noise_floor, [one.trial.name for one in validation])


def _error(trials: Sequence[ContactTrial], contact: ContactModel, joints: Sequence[str]) -> ErrorSummary:
    """RMS error [rad], offsets and the box's place fitted in each trial."""
    residuals = [np.where(one.trial.valid[:, None], one.residual(contact), np.nan) for one in trials]
    return summarise_errors(residuals, tuple(joints))
