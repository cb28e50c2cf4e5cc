"""One physical effect of a drive: its parameters, where it acts, its law."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import isfinite, nan
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from tactile_cube.drivetrain import signals
from tactile_cube.drivetrain.effects.scales import Scales, unit_at
from tactile_cube.errors import InputError

Array = npt.NDArray[np.float64]
View = Callable[[str], Array]


class Stage(Enum):
    """Where an effect acts; the value is the row of `x` that its law returns anew (MECHANISM: no law)."""

    COMMAND = signals.COMMAND
    VELOCITY_SENSOR = signals.MEASURED_VELOCITY
    MOTOR_TORQUE = signals.TORQUE
    DEFLECTION = signals.DEFLECTION
    POSITION_SENSOR = signals.MOTOR_POSITION
    JOINT_TORQUE = signals.JOINT_TORQUE
    FRICTION = signals.FRICTION
    MECHANISM = -1


@dataclass(frozen=True)
class Parameter:
    """A number of an effect, its sizes stated for a finger's joint; `at` tells them for a joint of any other size.

    Attributes:
        name: its key in configurations and model files.
        unit: SI, `1` for none, of a joint that turns; at one that slides `N m` stands for N and `rad` for m.
        neutral: the value at which the effect changes nothing.
        low: smallest value that a search may try.
        high: largest.
        typical: a usual size, where a search starts.
        source: where the figures come from.
        scale: size of a noticeable change; None: as large as the value a search starts from.
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    typical: float
    source: str
    scale: float | None = None

    def at(self, scales: Scales) -> Parameter:
        """The same number at a joint of these sizes."""
        factor = scales.of(self.unit)
        sizes = {key: factor * getattr(self, key) for key in ("neutral", "low", "high", "typical")}
        scale = None if self.scale is None else factor * self.scale
        return replace(self, **sizes, scale=scale, unit=unit_at(self.unit, scales.slides))


@dataclass(frozen=True)
class Place:
    """The joint that a mechanism effect changes.

    Attributes:
        joint: plant-wide index.
        chain: finger.
        link: dof of the joint in its chain.
        followers: dofs of the chain that are coupled to the joint (an index list, possibly empty).
    """

    joint: int
    chain: int
    link: int
    followers: tuple[int, ...] = ()

    @property
    def outermost(self) -> int:
        """The last dof that the joint moves by itself: its own or its last follower."""
        return max((self.link, *self.followers))


class Effect:
    """An effect on one joint, with values; subclass it to describe a new one.

    A subclass states `name`, `stage`, `parameters`, and gives `law` (or `configure` for a MECHANISM); without them it
    cannot be defined. With every parameter at its neutral value the law returns the row's own value, bit for bit.

    Example:
        >>> class CableDrag(Effect):
        ...     name, stage = "cable_drag", Stage.JOINT_TORQUE
        ...     parameters = (Parameter("stiffness", "N m/rad", 0.0, 0.0, 1.0, 0.05, "spring balance"),)
        ...
        ...     @staticmethod
        ...     def law(x, j, p, s, dt):
        ...         return x[JOINT_TORQUE, j] - p[0] * x[POSITION, j]
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    parameters: ClassVar[tuple[Parameter, ...]]
    forms: ClassVar[tuple[dict[str, float], ...]] = ()
    """Alternative descriptions that a search tries in turn: parameters fitted and their starts, the rest neutral.

    Empty: one form, all parameters at their typical values.
    """
    details: ClassVar[tuple[str, ...]] = ()
    """Parameters that make a form richer: a search frees them where the form follows the data already, never before."""
    contains: ClassVar[tuple[str, ...]] = ()
    """Names of simpler effects that this one becomes at some of its values, so that it always follows data as well."""
    constant_reading: ClassVar[str] = ""
    """The parameter by which it adds a constant to the reading of the position, as every initialisation does."""
    from_residual: ClassVar[tuple[str, ...]] = ("harmonic", "torque_0")
    """Parameters whose start is read from what is missing: a form that has one waits for a fitted model."""

    def __init_subclass__(cls) -> None:
        """Refuse a class that lacks what its stage asks for.

        Raises:
            InputError: it has no name, stage, parameters or law.
        """
        lacks = [key for key in ("name", "stage", "parameters") if not hasattr(cls, key)]
        if not lacks and cls.stage is Stage.MECHANISM and not cls.defines("configure"):
            lacks = ["a static method configure(view, place, p)"]
        if not lacks and cls.stage is not Stage.MECHANISM and not cls.defines("law"):
            lacks = ["a static method law(x, j, p, s, dt)"]
        if lacks:
            raise InputError(f"effect class {cls.__module__}.{cls.__qualname__} lacks {', '.join(lacks)}")

    @classmethod
    def defines(cls, law: str) -> bool:
        """Whether the class has its own `law`, `torque_law`, `ahead_law` or `configure`."""
        return getattr(cls, law) is not getattr(Effect, law)

    def __init__(self, joint: str, **values: float) -> None:
        """Place the effect on `joint`; parameters not given are as `defaults` has them.

        Raises:
            InputError: an unknown parameter or a value that is no finite number.
        """
        self.joint = joint
        defaults = self.defaults(values)
        self.values = {key: float(values.pop(key, default)) for key, default in defaults.items()}
        for key in values:
            known = ", ".join(p.name for p in self.parameters)
            raise InputError(f"effect '{self.name}' has no parameter '{key}'; it has {known}")
        for key, value in self.values.items():
            if not isfinite(value):
                raise InputError(f"effect '{self.name}': {key} is {value}; give a finite number")

    @classmethod
    def parameters_at(cls, scales: Scales) -> dict[str, Parameter]:
        """The parameters by name with the sizes that they have at a joint."""
        return {p.name: p.at(scales) for p in cls.parameters}

    @classmethod
    def defaults(cls, given: Collection[str] = ()) -> dict[str, float]:
        """What a parameter is when only the `given` ones are stated: typical, or neutral if it is of another form."""
        every = {key for form in cls.forms for key in form}
        named = every.intersection(given)
        meant = {key for form in cls.forms if named <= form.keys() for key in form}
        other = every - meant
        return {p.name: p.neutral if p.name in other else p.typical for p in cls.parameters}

    @classmethod
    def forms_at(cls, scales: Scales) -> list[dict[str, float]]:
        """The forms, or all parameters at their typical values, with the sizes that they have at a joint."""
        factor = {p.name: scales.of(p.unit) for p in cls.parameters}
        plain = cls.forms or ({p.name: p.typical for p in cls.parameters},)
        return [{name: factor[name] * value for name, value in form.items()} for form in plain]

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Where a search begins at a joint: parameters to fit and their starts.

        By default the forms. In a form of several numbers the first one that may have either sign starts with both: a
        first look scales a whole effect, and one number's sign is not that of the whole.
        """
        known = cls.forms_at(scales)
        signed = {p.name for p in cls.parameters if p.neutral == 0.0 and p.low < 0.0}
        for form in list(known):
            first = next((name for name, value in form.items() if name in signed and value), None)
            known += [{**form, first: -form[first]}] if first and len(form) > 1 else []
        return known

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Values of parameters that are not fitted but follow from what a recording shows of the joint."""
        return {}

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Those of `details` that a recording of the joint can tell, where the plain form has these values."""
        return cls.details

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Whether it can act at a joint at all."""
        return True

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """What a recording of the joint lacks to show the effect, were it there; None: nothing."""
        return None

    @classmethod
    def state_size(cls, dt: float) -> int:
        """How many numbers the law remembers between steps of `dt` [s]; they are zero after a reset."""
        return 0

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """The new value of the stage's row for joint j; scalar Python that Numba compiles.

        Args:
            x: (ROWS, n) signals of the joint's finger, see `signals`; columns are joints, so neighbours are visible.
            j: the joint's column.
            p: (parameters,) values in the order of `parameters`.
            s: (state_size,) the law's own memory, to be changed in place.
            dt: step [s].
        """
        return nan  # of a MECHANISM, which is never asked

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """The new motor torque of joint j [N m], for effects that act there too; arguments as of `law`."""
        return x[signals.TORQUE, j]

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """The part of a POSITION_SENSOR law [rad] that is known before the torque, which feels it without delay."""
        return x[signals.MOTOR_POSITION, j]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Change the plant's constants before a simulation (MECHANISM effects).

        Args:
            view: `view(key)` is a writable view of the plant's memory; leading dimensions are a batch.
            place: the joint.
            p: (..., parameters) with the same leading dimensions.
        """

    def __repr__(self) -> str:  # noqa: D105
        values = ", ".join(f"{key}={value:g}" for key, value in self.values.items())
        return f"{type(self).__name__}('{self.joint}', {values})"
