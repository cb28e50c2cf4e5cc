"""Several numbers of one effect at once: those that change how far the fingers give way, without a corner anywhere.

A box whose weight lies elsewhere tilts in the grip; no single one of the three coordinates shows beside wrong others.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.contact.search import pooled_cost
from tactile_cube.identification.contact.trial import EVERY, ContactTrial
from tactile_cube.identification.contact.unknown import Unknown
from tactile_cube.measurement.replay.hand_replay import Contact

Array = NDArray[np.float64]
STEPS = 3  # of Gauss and Newton
SHARES = (1.0, 0.4)  # of a step that are tried
TRUSTED = 60.0  # measured numbers as which a trial counts, beside one of what is expected of each unknown
KNOWN = 0.5  # standard deviation over what was expected, below which the trials know a number


def solved(trials: Sequence[ContactTrial], contact: Contact, wanted: Sequence[Unknown]) -> tuple[Contact, list[bool]]:
    """The contact with all parameters of an effect at the values that suit the trials best, and which of them show.

    Args:
        trials: to fit.
        contact: where to start.
        wanted: all parameters of one effect, none of them by factors.
    """
    typical = np.array([one.parameter.typical for one in wanted])
    values = np.array([contact.values.get(one.effect.name, {}).get(one.parameter.name, 0.0) for one in wanted])
    slopes = np.zeros((0, len(wanted)))
    for _ in range(STEPS):
        slopes, target = _linearised(trials, contact, wanted, values, typical)
        step = -np.linalg.lstsq(slopes, target, rcond=None)[0] * typical
        before = pooled_cost(trials, contact, wanted[0].effect)
        for share in SHARES:
            tried = _put(contact, wanted, values + share * step)
            if pooled_cost(trials, tried, wanted[0].effect) < before:
                contact = tried
                values = np.array([tried.values[one.effect.name][one.parameter.name] for one in wanted])
                break
        else:
            break
    spread = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    return contact, [bool(one < KNOWN) for one in spread]


def _linearised(
    trials: Sequence[ContactTrial], contact: Contact, wanted: Sequence[Unknown], values: Array, typical: Array
) -> tuple[Array, Array]:
    """Slopes (R, P) per typical value, and residual (R,), each trial in units of its own error; expectations below."""
    base = [_seen(one, contact) for one in trials]
    weights = [np.sqrt(TRUSTED / len(one)) / max(float(np.sqrt(np.mean(one**2))), 1e-9) for one in base]
    columns = []
    for k, unknown in enumerate(wanted):
        side = 1.0 if values[k] + typical[k] <= unknown.parameter.high else -1.0
        moved = unknown.put(_put(contact, wanted, values), float(values[k] + side * typical[k]))
        change = [side * w * (_seen(one, moved) - b) for one, b, w in zip(trials, base, weights, strict=True)]
        columns.append(np.concatenate(change))
    slopes = np.vstack([np.stack(columns, axis=1), np.eye(len(wanted))])
    residual = np.concatenate([w * b for b, w in zip(base, weights, strict=True)])
    return slopes, np.concatenate([residual, values / typical])


def _seen(trial: ContactTrial, contact: Contact) -> Array:
    return trial.residual(contact)[trial.trial.valid][::EVERY].ravel()


def _put(contact: Contact, wanted: Sequence[Unknown], values: Array) -> Contact:
    for unknown, value in zip(wanted, values, strict=True):
        contact = unknown.put(contact, unknown.unscaled(float(value)))
    return contact
