"""File of an identified model: values, intervals, effects, provenance and errors, as plain YAML."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from tactile_cube import limits
from tactile_cube.drivetrain.plain_yaml import describe, read_schema
from tactile_cube.errors import InputError
from tactile_cube.whole_file import write_whole

OBJECT_EFFECTS = (
    "lateral_friction", "spinning_friction", "tip_compliance", "object_mass", "object_com", "object_size"
)  # fmt: skip
"""Effects of fingertips and object, which `simulation.contact_effects` describes; no joint has them."""
NOT_NEGATIVE = ("kp", "kd", "torque_limit", "stiffness", "static_friction", "reflected_inertia")
MAY_BE_INFINITE = ("stiffness", "torque_limit", "rate_limit")
"""Constants of a drive that may be infinite: it is rigid, or not limited."""


class Strict(BaseModel):
    """Unknown keys are refused: a misspelt key must not silently change nothing."""

    model_config = ConfigDict(extra="forbid")


class Estimate(Strict):
    """A value with its 95 % interval; `low` and `high` equal `value` where nothing was estimated."""

    value: float
    low: float
    high: float
    unit: str = ""

    @model_validator(mode="before")
    @classmethod
    def _bare_number(cls, data: Any) -> Any:
        if isinstance(data, int | float | str):
            return {"value": data, "low": data, "high": data}
        return data

    @model_validator(mode="after")
    def _ordered(self) -> "Estimate":
        if not self.low <= self.value <= self.high:
            raise ValueError(f"the interval [{self.low:g}, {self.high:g}] does not hold the value {self.value:g}")
        large = [one for one in (self.low, self.value, self.high) if limits.NUMBER < abs(one) < math.inf]
        if large:
            raise ValueError(f"{large[0]:g} is beyond {limits.NUMBER:g}; write .inf if that is meant")
        return self

    @property
    def finite(self) -> bool:
        """Whether value and interval are finite."""
        return all(map(math.isfinite, (self.low, self.value, self.high)))


class EffectEstimate(Strict):
    """One effect, `NAME@JOINT` (or `NAME` alone for an effect of the object), and its parameters."""

    effect: str
    parameters: dict[str, Estimate] = Field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name in the catalogue, or the dotted path of a user's own effect."""
        return self.effect.partition("@")[0]

    @property
    def joint(self) -> str | None:
        """The joint it acts on; None for an effect of the object."""
        return self.effect.partition("@")[2] or None

    @property
    def of_object(self) -> bool:
        """Whether it is an effect of the contact, not of the drivetrain."""
        return self.name in OBJECT_EFFECTS


class Provenance(Strict):
    """Where the values come from."""

    recording: str = ""
    command: str = ""
    created: str = ""
    version: str = ""
    seed: int | None = None
    trials: list[str] = Field(default_factory=list)
    held_out: list[str] = Field(default_factory=list)


class ModelErrors(Strict):
    """RMS position error [rad] on held-out trials at each stage; `joints` maps a stage to joint -> error.

    `over_noise` is that of the last stage in segments that are simulated one by one, in units of the sensor noise.
    """

    nominal: float | None = None
    refitted: float | None = None
    with_effects: float | None = None
    noise_floor: float | None = None
    over_noise: float | None = None
    joints: dict[str, dict[str, float]] = Field(default_factory=dict)


class ModelFile(Strict):
    """An identified model.

    Attributes:
        rig: name of the URDF that was identified.
        joints: actuated joints in column order.
        values: parameter -> joint -> estimate; parameters are kp [N m/rad], kd [N m s/rad], torque_limit [N m],
            stiffness [N m/rad], static_friction [N m], reflected_inertia [kg m^2], friction_creep [rad/s per N m],
            reading_delay [s].
        effects: what had to be added to the plain drivetrain.
        offsets: joint -> offset of the joint's zero [rad]; the interval spans the robot initialisations.
        provenance: recording, command, version, seed, trials.
        errors: RMS position errors [rad] before and after.
    """

    format: Literal[1] = 1
    rig: str = ""
    joints: list[str]
    values: dict[str, dict[str, Estimate]] = Field(default_factory=dict)
    effects: list[EffectEstimate] = Field(default_factory=list)
    offsets: dict[str, Estimate] = Field(default_factory=dict)
    provenance: Provenance = Field(default_factory=Provenance)
    errors: ModelErrors = Field(default_factory=ModelErrors)

    @property
    def drive_effects(self) -> list[EffectEstimate]:
        """The effects of the drivetrain."""
        return [one for one in self.effects if not one.of_object]

    @property
    def object_effects(self) -> list[EffectEstimate]:
        """The effects of fingertips and object."""
        return [one for one in self.effects if one.of_object]

    def of_a_hand(self) -> "ModelFile":
        """Return the model without infinite values: a rig that is rigid or not limited says nothing of a hand."""
        values = {key: {joint: one for joint, one in row.items() if one.finite} for key, row in self.values.items()}
        return self.model_copy(update={"values": {key: row for key, row in values.items() if row}})

    def with_effects(self, found: Sequence[EffectEstimate]) -> list[EffectEstimate]:
        """Return its effects and those found, which take the place of those of the same name."""
        names = {one.effect for one in found}
        return [*(one for one in self.effects if one.effect not in names), *found]

    @model_validator(mode="after")
    def _said_once(self) -> "ModelFile":
        for key, names in (("joints", self.joints), ("effects", [one.effect for one in self.effects])):
            twice = [name for name, count in Counter(names).items() if count > 1]
            if twice:
                raise ValueError(f"{key} names '{twice[0]}' more than once")
        return self

    @model_validator(mode="after")
    def _possible_constants(self) -> "ModelFile":
        named = [(f"values.{key}.{joint}", one, key) for key, row in self.values.items() for joint, one in row.items()]
        named += [(f"offsets.{joint}", one, "offsets") for joint, one in self.offsets.items()]
        for where, one, key in named:
            if not (one.finite or key in MAY_BE_INFINITE) or (key in NOT_NEGATIVE and one.value < 0.0):
                numbers = f"{one.value:g} in [{one.low:g}, {one.high:g}]"
                raise ValueError(f"{where} is {numbers}; give finite numbers{', 0 or more' * (key in NOT_NEGATIVE)}")
        return self

    @model_validator(mode="after")
    def _known_joints(self) -> "ModelFile":
        named = {joint: f"values.{key}" for key, joints in self.values.items() for joint in joints}
        named |= dict.fromkeys(self.offsets, "offsets")
        named |= {effect.joint: f"effects {effect.effect}" for effect in self.effects if effect.joint}
        for joint, key in named.items():
            if joint not in self.joints:
                raise ValueError(f"{key} names joint '{joint}', which is not among joints {self.joints}")
        return self


def read_model(path: str | Path) -> ModelFile:
    """Read the model in a YAML file. Raises InputError: naming the file, the key and the value received."""
    return read_schema(Path(path), ModelFile)


def as_model(given: ModelFile | Mapping[str, Any] | str | Path) -> ModelFile:
    """Return a model, from its contents or from the path of its file.

    Raises:
        InputError: naming the key and the value received.
    """
    if isinstance(given, ModelFile):
        return given
    if isinstance(given, str | Path):
        return read_model(given)
    try:
        return ModelFile.model_validate(_plain(given))
    except ValidationError as error:
        raise InputError(f"model: {describe(error)}") from None


def write_model(model: ModelFile, path: str | Path) -> None:
    """Write `model` as plain YAML, keys in the order of the schema."""
    write_whole(Path(path), yaml.safe_dump(model.model_dump(), sort_keys=False).encode())


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, Sequence) and not isinstance(value, str) else value
