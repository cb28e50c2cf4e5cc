"""Contact effects: properties of fingertips and object that are constants of an episode, one class each."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from tactile_cube.drivetrain.effects import Effect, Parameter, Stage, find_effect
from tactile_cube.drivetrain.effects.effect import Scales
from tactile_cube.errors import InputError
from tactile_cube.simulation.constants import EpisodeConstants

LEAST_MASS = 0.1
"""Smallest share of the stated mass: a search may try values that would leave less than nothing."""
COARSE, RATIO = 5, 2.3
"""Least number of values of a first grid, and the largest ratio of neighbours."""
_UNEVEN = "a guess: a cube of 8 cm that is filled unevenly"


class ContactEffect(Effect):
    """A contact effect; a subclass states data only, and its neutral values are the constants of the paper.

    Attributes:
        constant: the field of EpisodeConstants that it changes.
        added: whether its values are added to the constant; otherwise they replace it.
    """

    name, stage = "contact", Stage.CONTACT
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    constant: ClassVar[str]
    added: ClassVar[bool] = False

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return a coarse grid over the range of a single number, or the neutral values of several."""
        (one, *others) = cls.parameters
        if others:
            return [{p.name: p.neutral for p in cls.parameters}]
        factors = np.log(one.high / one.low) if one.low > 0.0 else 0.0
        count = max(COARSE, int(np.ceil(factors / np.log(RATIO))) + 1)
        grid = np.geomspace if factors else np.linspace
        return [{one.name: float(value)} for value in grid(one.low, one.high, count)]

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """Return the constants with this effect; parameters that `values` leaves out are neutral.

        Raises:
            InputError: an unknown parameter.
        """
        known = {one.name: one.neutral for one in cls.parameters}
        for key in values:
            if key not in known:
                raise InputError(f"effect {cls.name}: no parameter '{key}'; it has {', '.join(known)}")
        numbers: Any = [values.get(key, neutral) for key, neutral in known.items()]
        change = np.array(numbers) if len(numbers) > 1 else numbers[0]
        if cls.added and not np.any(change):
            return constants
        stated = getattr(constants, cls.constant)
        changed: dict[str, Any] = {cls.constant: stated + change if cls.added else change}
        return dataclasses.replace(constants, **changed)


class LateralFriction(ContactEffect):
    """Coulomb friction between fingertip and object.

    |sideways force| <= coefficient * normal force.

    In data: the object slips in the hand, earlier than in the model or later.
    Confused with: `object_mass` where the load that makes it slip is its weight.
    """

    name = "lateral_friction"
    constant = "tip_friction"
    parameters = (
        Parameter(
            "coefficient", "1", neutral=0.9, low=0.2, high=1.6, typical=0.6, source="website: 0.9; rubber 0.5-1.2"
        ),
    )


class SpinningFriction(ContactEffect):
    """Resistance of a fingertip against being turned on the spot.

    |torque about the contact normal| <= radius * normal force. The length is about the contact patch's radius times the
    friction coefficient.

    In data: the object turns about the line between two tips, earlier than in the model or later.
    Confused with: `object_com`, which changes the torque at which it turns.
    """

    name = "spinning_friction"
    constant = "tip_spinning_friction"
    parameters = (
        Parameter(
            "radius", "m", neutral=0.003, low=2e-4, high=0.3, typical=0.02, source="website: 0.1, 0.03, 2e-4..2e-2"
        ),
    )


class TipCompliance(ContactEffect):
    """Fingertip skin that gives way in proportion to the normal force.

    depth = compliance * normal force.

    In data: closing fingers go further with the force.
    Confused with: `elasticity` of the joints, without a contact sensor.
    """

    name = "tip_compliance"
    constant = "tip_compliance"
    parameters = (
        Parameter("compliance", "m/N", neutral=0.0, low=0.0, high=2e-3, typical=3e-4, source="stiffness 1e3..1e4 N/m"),
    )


class ObjectMass(ContactEffect):
    """Mass of the object beyond the stated one.

    m = stated mass + excess; at least a tenth of the stated mass remains.

    In data: joints give way with the weight; the object slips earlier.
    Confused with: `lateral_friction` where the object slips; `torque_gain` of the joints.
    """

    name = "object_mass"
    constant = "cube_mass"
    added = True
    parameters = (
        Parameter("excess", "kg", neutral=0.0, low=-0.1, high=0.2, typical=0.05, source="a guess: fillings, cables"),
    )

    @classmethod
    def apply(cls, constants: EpisodeConstants, values: Mapping[str, float]) -> EpisodeConstants:
        """Return the constants with this effect; at least a tenth of the stated mass remains."""
        least = (LEAST_MASS - 1.0) * constants.cube_mass
        return super().apply(constants, {key: max(value, least) for key, value in values.items()})


class ObjectCom(ContactEffect):
    """Displacement of the object's centre of mass, in the object's frame.

    c = stated centre + (x, y, z).

    In data: the fingers on one side carry more than those on the other.
    Confused with: joint offsets of a single initialisation.
    """

    name = "object_com"
    constant = "cube_com"
    added = True
    parameters = (
        Parameter("x", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_UNEVEN),
        Parameter("y", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_UNEVEN),
        Parameter("z", "m", neutral=0.0, low=-0.03, high=0.03, typical=0.01, source=_UNEVEN),
    )


class ObjectSize(ContactEffect):
    """Length added to each edge of the object.

    size = stated size + excess.

    In data: the fingers close earlier or later, alike in all initialisations.
    Confused with: joint offsets, in a single initialisation.
    """

    name = "object_size"
    constant = "cube_size"
    added = True
    parameters = (
        Parameter(
            "excess", "m", neutral=0.0, low=-0.01, high=0.01, typical=0.003, source="website: cubes differ by 5 mm"
        ),
    )


_EFFECTS: tuple[type[ContactEffect], ...] = (
    LateralFriction,
    SpinningFriction,
    TipCompliance,
    ObjectMass,
    ObjectCom,
    ObjectSize,
)


def contact_catalogue() -> dict[str, type[ContactEffect]]:
    """Return all contact effects by name; they need a recording with an object."""
    return {effect.name: effect for effect in _EFFECTS}


def find_any_effect(name: str) -> type[ContactEffect] | type[Effect]:
    """Return an effect of the contact or of the drivetrain.

    Raises:
        InputError: there is no such effect.
    """
    return contact_catalogue().get(name) or find_effect(name)


def is_contact_effect(name: str) -> bool:
    """Return whether `NAME` or `NAME@...` names a contact effect."""
    return name.partition("@")[0] in contact_catalogue()
