"""A stand-in for trials with an object whose error is known in closed form, so that searches are tested in no time."""

from types import SimpleNamespace

import numpy as np

from tactile_cube.measurement.hand_replay import Contact

JOINTS = tuple("abcdefghijkl")


class EasyTrial:
    """Slips as its friction says: the error grows with the distance from the truth on both sides."""

    def __init__(
        self, kind: str, initialisation: int, truth: dict[tuple[str, str], float], neutral: dict[tuple[str, str], float]
    ) -> None:
        name, valid = f"{kind}_{initialisation}", np.ones(40, dtype=bool)
        self.trial = SimpleNamespace(kind=kind, name=name, initialisation=initialisation, valid=valid)
        self.truth, self.neutral = truth, neutral
        self.noise = np.random.default_rng(initialisation).normal(size=(40, len(JOINTS)))

    def residual(self, contact: Contact) -> np.ndarray:
        off = 0.0
        for (effect, parameter), truth in self.truth.items():
            value = contact.values.get(effect, {}).get(parameter, self.neutral[effect, parameter])
            off += abs(np.log(value / truth)) if truth > 0 else abs(value - truth)
        return 1e-3 * self.noise + 1e-2 * off

    def cost(self, contact: Contact) -> float:
        return float(np.mean(self.residual(contact) ** 2) / 1e-6)


def friction(kind: str, initialisation: int, lateral: float = 0.9, spinning: float = 0.1) -> EasyTrial:
    """A trial that shows lateral friction (`hold`) or spinning friction (`twist`)."""
    lateral_key, spinning_key = ("lateral_friction", "coefficient"), ("spinning_friction", "radius")
    neutral = {lateral_key: 0.9, spinning_key: 0.1}
    truth = {lateral_key: lateral} if kind == "hold" else {spinning_key: spinning}
    return EasyTrial(kind, initialisation, truth, neutral)
