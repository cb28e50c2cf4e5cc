"""A stand-in for trials with an object whose error is known in closed form, so that searches are tested in no time."""

from types import SimpleNamespace

import numpy as np

from tactile_cube.measurement.replay.hand_replay import ContactModel

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

    def residual(self, contact: ContactModel) -> np.ndarray:
        off = 0.0
        for (effect, parameter), truth in self.truth.items():
            value = contact.values.get(effect, {}).get(parameter, self.neutral[effect, parameter])
            off += abs(np.log(value / truth)) if truth > 0 else abs(value - truth)
        return 1e-3 * self.noise + 1e-2 * off

    freedom = 12

    def prior_penalty(self, contact: ContactModel) -> float:
        """Of offsets that a grip needs for another size than the true one."""
        size = self.truth.get(("object_size", "excess"), 0.0)
        excess = contact.values.get("object_size", {}).get("excess", 0.0)
        return float(self.freedom + ((excess - size) / 1e-3) ** 2)

    def cost(self, contact: ContactModel) -> float:
        return float(np.mean(self.residual(contact) ** 2) / 1e-6)


class GrippedTrial(EasyTrial):
    """Joint offsets make up for every size of the object."""

    def residual(self, contact: ContactModel) -> np.ndarray:
        return 1e-3 * self.noise


class LoadedTrial(EasyTrial):
    """Gives way in proportion to three numbers that no joint shows apart."""

    truth_xyz = np.array([-0.006, 0.011, 0.004])

    def residual(self, contact: ContactModel) -> np.ndarray:
        values = contact.values.get("object_com", {})
        off = np.array([values.get(key, 0.0) for key in "xyz"]) - self.truth_xyz
        mixed = np.random.default_rng(7).normal(size=(len(JOINTS), 3))
        return 1e-4 * self.noise + 0.3 * mixed @ off


def friction(kind: str, initialisation: int, lateral: float = 0.9, spinning: float = 0.1) -> EasyTrial:
    """A trial that shows lateral friction (`hold`) or spinning friction (`twist`)."""
    lateral_key, spinning_key = ("lateral_friction", "coefficient"), ("spinning_friction", "radius")
    neutral = {lateral_key: 0.9, spinning_key: 0.1}
    truth = {lateral_key: lateral} if kind == "hold" else {spinning_key: spinning}
    return EasyTrial(kind, initialisation, truth, neutral)
