"""Rival explanations of a recording, fitted as a diagnosis fits them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.fitting.gauss_newton import Fit
from tactile_cube.identification.fitting.problem import Shooting
from tactile_cube.identification.search.search import Search
from tactile_cube.measurement.comparing.noise_floor import sensor_noise
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.measurement.replay.model import Term
from tactile_cube.measurement.split import held_out_split

Rival = dict[str, dict[str, float]]
"""Effects at the first joint, each with the values that its fit starts at."""


def fitted_rivals(recording: Recording, *rivals: Rival) -> tuple[Shooting, dict[str, Fit], NDArray[np.float64]]:
    """What simulates the recording, each rival's fit, and the sensor noise."""
    fitted, held_out = held_out_split(recording)
    noise = sensor_noise(recording)
    effects = list(dict.fromkeys(find_effect(name) for rival in rivals for name in rival))
    search = Search(fitted, held_out, noise, effects, lambda line: None)
    fits = {}
    for rival in rivals:
        named = [(find_effect(name)(recording.joints[0], **start), tuple(start)) for name, start in rival.items()]
        terms = tuple(Term(type(effect), recording.joints[0], effect.values, free) for effect, free in named)
        fits["+".join(rival)] = search.refitted(replace(search.start, terms=terms))
    return search.shooting, fits, noise
