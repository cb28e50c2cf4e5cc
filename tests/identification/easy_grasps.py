"""Grasps whose motion is known in closed form: a machine for the search, simulated in no time."""

from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from tactile_cube.identification.contact.grasps import OFFSET, PLACING, Grasps, OpenGrasps
from tactile_cube.measurement.replay.hand_replay import ContactModel
from tactile_cube.measurement.replay.model import Model

JOINTS = 12
TIME = np.arange(320) / 80.0  # [s]
MIXED = np.random.default_rng(7).normal(size=(3, JOINTS))
Values = dict[str, dict[str, float]]


class EasyGrasp:
    """A load that slips once the grip is too loose for it, earlier with less friction, and deflects the joints."""

    def __init__(self, kind: str, number: int, truth: Values) -> None:
        rng = np.random.default_rng(100 * number + len(kind))
        self._luck = rng.normal(0.0, 0.05)  # of its friction, by factors
        motion, unknown = self._motion(ContactModel(truth), kind, self._luck)
        self._measured = motion + rng.normal(0.0, 5e-4, motion.shape)
        self._needed = unknown + np.r_[np.random.default_rng(number).uniform(-OFFSET, OFFSET, JOINTS), np.zeros(3)]
        self.trial = SimpleNamespace(
            kind=kind, name=f"{kind}_{number}", initialisation=number, position=motion, valid=TIME >= 0.0
        )
        self.spread, self.free = np.r_[np.full(JOINTS, OFFSET), np.full(3, PLACING)], np.arange(JOINTS + 3)

    def fitted(self, contact: ContactModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As a grasp's own: what a contact needs, and what it leaves."""
        motion, unknown = self._motion(contact, self.trial.kind)
        return self._needed - unknown, self._measured - motion

    def _motion(self, contact: ContactModel, kind: str, luck: float = 0.0) -> tuple[NDArray[np.float64], ...]:
        def value(effect: str, parameter: str, neutral: float = 0.0) -> float:
            return contact.values.get(effect, {}).get(parameter, neutral)

        weight = max(1.0 + value("object_mass", "excess") / 0.1, 0.1)
        friction = value("lateral_friction", "coefficient", 0.9) / 0.9
        if kind == "twist":
            friction = value("spinning_friction", "radius", 0.003) / 0.003
        slip = 2.2 + (np.log(friction) + luck - np.log(weight))
        loaded = (TIME > 0.5) & (slip > TIME)
        lever = MIXED.T @ [value("object_com", axis) for axis in "xyz"]
        joints = np.linspace(1.0, 0.2, JOINTS)
        motion = 15e-3 * weight * loaded[:, None] * joints + loaded[:, None] * lever
        motion = motion + 4.0 * value("tip_compliance", "compliance") * np.minimum(TIME, 1.0)[:, None] * joints[::-1]
        motion = motion + 1.2 * value("object_size", "excess") * np.minimum(TIME / 0.5, 1.0)[:, None] * joints
        return motion, np.r_[np.full(JOINTS, value("object_size", "excess") / 0.08), np.zeros(3)]


def easy_grasps(truth: Values, initialisations: int = 4) -> OpenGrasps:
    """Held and twisted loads in each initialisation, the last of which is held out."""
    made = [EasyGrasp(kind, k, truth) for k in range(initialisations) for kind in ("hold", "twist")]
    fitted, held_out = (Grasps(part) for part in (made[:-2], made[-2:]))  # type: ignore[arg-type]
    return OpenGrasps(fitted, held_out, Model({}, (), {}), 1e-3, lambda part: part)
