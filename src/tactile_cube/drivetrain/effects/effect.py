"""A physical effect of a drive: its parameters, where it acts, its law."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import inf, isfinite, nan
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from tactile_cube.drivetrain import signals
from tactile_cube.errors import InputError

UNITS = re.compile(r"(N m|N|rad|kg|m|s|Hz)(?:\^(\d))?")
MORE_PERIODS = 3.0  # a sliding joint has this many times the periods of a turning one
FINGER_RANGE = 1.2  # [rad] of a finger's joint; corresponds to the range of a joint that slides


@dataclass(frozen=True)
class Scales:
    """Sizes of one joint; of a joint that slides in m, N and kg instead of rad, N m and kg m^2.

    Attributes:
        torque: usual torque of the drive, exceeded in a tenth of the samples [N m].
        often: torque exceeded in half of the samples [N m].
        seldom: largest torque but for a few samples [N m].
        low: lowest position, without a few samples [rad].
        high: highest [rad].
        speed: largest speed of the joint, without a few samples [rad/s].
        command_speed: largest speed of the command, without a few samples [rad/s].
        inertia: at the mean configuration, rotor included [kg m^2].
        mass: of all links that the joint moves [kg].
        lever: radius of gyration of these links about the joint [m].
        time: the time that corresponds to 1 s of a finger, a power of ten [s].
        slides: whether the joint is prismatic.
        neighbours: number of other joints of the rig.
        leads: whether another joint follows this one.
        first: whether it is the first joint of the rig.
        torque_limit: stated limit of the controller [N m]; infinite without one.
        lower: stated lower end of the joint [rad]; infinite without one.
        upper: stated upper end [rad].
        lasts: time from the start of an initialisation to the end of its last trial [s].
    """

    torque: float
    often: float
    seldom: float
    low: float
    high: float
    speed: float
    command_speed: float
    inertia: float
    mass: float
    lever: float
    time: float
    slides: bool = False
    neighbours: int = 0
    leads: bool = False
    first: bool = True
    torque_limit: float = inf
    lower: float = -inf
    upper: float = inf
    lasts: float = 0.0

    @property
    def span(self) -> float:
        """Range of motion [rad]."""
        return self.high - self.low

    @property
    def position(self) -> float:
        """What 1 rad of a finger's joint corresponds to: 1 rad, or for a joint that slides a part of its range [m]."""
        return self.span / FINGER_RANGE if self.slides else 1.0

    def of(self, unit: str) -> float:
        """Return how many times larger a number of a unit (`N m s/rad`) is at this joint than at a finger's.

        Torques, positions and speeds scale with those of the recording; inertias, masses and lengths with those of the
        rig. Times scale in powers of ten. Units other than these (K, V) do not scale.
        """
        plain = {"kg m^2": self.inertia / FINGER.inertia, "kg": self.mass / FINGER.mass, "s": self.time / FINGER.time}
        plain |= {"m": self.lever / FINGER.lever, "1": 1.0}
        if unit in plain:
            return plain[unit]
        if unit == "1/rad" and self.slides:
            return MORE_PERIODS / self.position
        speed = self.speed / FINGER.speed
        sizes = {"N m": self.torque / FINGER.torque, "rad": self.position, "s": self.position / speed}
        sizes |= {"N": sizes["N m"], "m": sizes["rad"], "kg": self.mass / FINGER.mass, "Hz": 1.0 / plain["s"]}
        above, _, below = unit.partition("/")
        factor = 1.0
        for text, sign in ((above, 1), (below, -1)):
            for name, power in UNITS.findall(text):
                factor *= sizes[name] ** (sign * int(power or 1))
        return factor


FINGER = Scales(
    torque=0.15,
    often=0.06,
    seldom=0.7,
    low=0.0,
    high=FINGER_RANGE,
    speed=5.0,
    command_speed=7.0,
    inertia=0.005,
    mass=0.18,
    lever=0.08,
    time=1.0,
    neighbours=2,
)
"""Sizes of the joints for which the catalogue states its numbers: small geared joints of 0.02 to 1 N m."""


def unit_at(unit: str, slides: bool) -> str:
    """Return a unit as it reads at a joint: `N m s/rad` is `N s/m` at one that slides."""
    if not slides:
        return unit
    for turning, sliding in (("kg m^2", "kg"), ("(N m)", "N"), ("N m", "N"), ("rad", "m")):
        unit = unit.replace(turning, sliding)
    return unit


Array = npt.NDArray[np.float64]
View = Callable[[str], Array]
Simpler = Mapping[str, Mapping[str, float]]


class Stage(Enum):
    """Where an effect acts; the value is the row of `x` whose new value the law returns.

    MECHANISM changes constants of a rig and CONTACT those of fingertips and object: no law.

    What a CONTROLLER adds counts for its torque limit, what MOTOR_TORQUE adds comes after it.
    """

    COMMAND = signals.COMMAND
    VELOCITY_SENSOR = signals.MEASURED_VELOCITY
    CONTROLLER = signals.CONTROLLER_TORQUE
    MOTOR_TORQUE = signals.TORQUE
    DEFLECTION = signals.DEFLECTION
    POSITION_SENSOR = signals.MOTOR_POSITION
    JOINT_TORQUE = signals.JOINT_TORQUE
    FRICTION = signals.FRICTION
    MECHANISM = -1
    CONTACT = -2


@dataclass(frozen=True)
class Parameter:
    """A number of an effect. Its sizes are those of a finger's joint; `at` returns them for any other joint.

    Attributes:
        name: its key in configurations and model files.
        unit: SI unit at a joint that turns, `1` for none; at one that slides, N replaces `N m` and m replaces `rad`.
        neutral: the value at which the effect changes nothing.
        low: smallest value that a search may try.
        high: largest value that a search may try.
        typical: usual value, at which a search starts.
        source: where the figures come from.
        scale: size of a noticeable change; None: as large as the value at which a search starts.
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
        """Return the same parameter at a joint of these sizes."""
        factor = scales.of(self.unit)
        sizes = {key: factor * getattr(self, key) for key in ("neutral", "low", "high", "typical")}
        scale = None if self.scale is None else factor * self.scale
        return replace(self, **sizes, scale=scale, unit=unit_at(self.unit, scales.slides))


def harmonic(source: str) -> Parameter:
    """Return the parameter `harmonic`: repetitions in 2 pi rad of the joint [1/rad].

    Its scale is a change that moves the ripple by a part of a period at the end of the range.
    """
    return Parameter("harmonic", "1/rad", neutral=10.0, low=1.0, high=250.0, typical=10.0, source=source, scale=0.5)


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
        """The last dof that the joint moves by itself: its own or its last follower's."""
        return max((self.link, *self.followers))


class Effect:
    """An effect on one joint, with values; subclass it to describe a new one.

    A subclass states `name`, `stage` and `parameters` and defines `law` (or `configure` for a MECHANISM). With every
    parameter at its neutral value the law returns the row's own value, bit for bit. Its docstring is shown to users: a
    line, the formula, then lines that begin with `In data:`, `Confused with:` and `Source:`.

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
    """Alternative forms that a search tries: the fitted parameters with their starts; the others are neutral.

    Empty: one form, all parameters at their typical values.
    """
    details: ClassVar[tuple[str, ...]] = ()  # parameters that a search frees last, where a form fits the data already
    detail_starts: ClassVar[Mapping[str, float]] = {}  # where it begins those that do little near their neutral values
    contains: ClassVar[Simpler] = {}
    """Simpler effects that are special cases of this one, and the parameters' values at which it becomes each of them.

    Each value alone suffices; an infinite one is the parameter's largest. Empty where no single value does it.
    """
    state_size: ClassVar[Any] = 0
    """How many numbers the law keeps between steps, zero after a reset; a class method of the step [s] if it counts."""
    bounded_memory: ClassVar[bool] = False
    """Whether the law of a COMMAND remembers no more steps than its state has numbers; older ones are not played."""
    weighs: ClassVar[bool] = False  # whether the law reads WEIGHT, which makes a step several per cent slower
    chosen_starts: ClassVar[int] = 0
    """Numbers of a state that no log shows, so that a fit chooses them where a trial begins."""
    constant_reading: ClassVar[str] = ""
    """The parameter that adds a constant to the measured position, as the joint offset of an initialisation does."""
    from_residual: ClassVar[tuple[str, ...]] = ("harmonic", "torque_0")
    """Parameters whose start comes from a fitted model's residual; a form with one of them is tried after a fit."""

    def __init_subclass__(cls) -> None:
        """Refuse a class that lacks what its stage needs.

        Raises:
            InputError: it has no name, stage, parameters or law.
        """
        lacks = [key for key in ("name", "stage", "parameters") if not hasattr(cls, key)]
        if not lacks and cls.stage is Stage.MECHANISM and not cls.defines("configure"):
            lacks = ["a static method configure(view, place, p)"]
        if not lacks and cls.stage.value >= 0 and not cls.defines("law"):
            lacks = ["a static method law(x, j, p, s, dt)"]
        if not isinstance(cls.contains, Mapping):
            given = f"effect class {cls.__module__}.{cls.__qualname__}: contains is {cls.contains!r}"
            raise InputError(
                f"{given}; give the values where it becomes each simpler effect, {{'NAME': {{'KEY': 0.0}}}}"
            )
        if lacks:
            raise InputError(f"effect class {cls.__module__}.{cls.__qualname__} lacks {', '.join(lacks)}")

    @classmethod
    def defines(cls, law: str) -> bool:
        """Return whether the class has its own `law`, `torque_law`, `ahead_law` or `configure`."""
        return getattr(cls, law) is not getattr(Effect, law)

    def __init__(self, joint: str, **values: float) -> None:
        """Place the effect on `joint`; `defaults` gives the parameters that are not stated.

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
        """Return the parameters by name, with their sizes at a joint."""
        return {p.name: p.at(scales) for p in cls.parameters}

    @classmethod
    def defaults(cls, given: Collection[str] = ()) -> dict[str, float]:
        """Return each parameter's value when only `given` ones are stated: typical, or neutral if of another form."""
        every = {key for form in cls.forms for key in form}
        named = every.intersection(given)
        meant = {key for form in cls.forms if named <= form.keys() for key in form}
        other = every - meant
        return {p.name: p.neutral if p.name in other else p.typical for p in cls.parameters}

    @classmethod
    def forms_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return the forms, or one of all parameters at their typical values, with their sizes at a joint."""
        factor = {p.name: scales.of(p.unit) for p in cls.parameters}
        plain = cls.forms or ({p.name: p.typical for p in cls.parameters},)
        return [{name: factor[name] * value for name, value in form.items()} for form in plain]

    @classmethod
    def starts_at(cls, scales: Scales) -> list[dict[str, float]]:
        """Return where a search begins at a joint: parameters to fit and their starts.

        By default these are the forms. In a form of several parameters, the first one that may have either sign starts
        with both, because screening scales all parameters of a form together.
        """
        known = cls.forms_at(scales)
        signed = {p.name for p in cls.parameters if p.neutral == 0.0 and p.low < 0.0}
        for form in list(known):
            first = next((name for name, value in form.items() if name in signed and value), None)
            known += [{**form, first: -form[first]}] if first and len(form) > 1 else []
        return known

    @classmethod
    def placed_at(cls, scales: Scales) -> dict[str, float]:
        """Return values of parameters that are not fitted but follow from the recording of the joint."""
        return {}

    @classmethod
    def details_at(cls, scales: Scales, values: Mapping[str, float]) -> tuple[str, ...]:
        """Return those of `details` that a recording of the joint can identify, where the form has these values."""
        return cls.details

    @classmethod
    def can_act(cls, scales: Scales) -> bool:
        """Return whether the effect can act at a joint at all."""
        return True

    @classmethod
    def unseen_at(cls, scales: Scales) -> str | None:
        """Return why a recording of the joint could not show the effect, in words; None if it could."""
        return None

    @classmethod
    def kept(cls, dt: float) -> int:
        """Return `state_size` for steps of `dt` [s]."""
        return int(cls.state_size(dt) if callable(cls.state_size) else cls.state_size)

    @staticmethod
    def law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the new value of the stage's row for joint j; scalar Python that Numba compiles.

        Args:
            x: (ROWS, n) signals of the joint's finger, see `signals`; columns are joints.
            j: the joint's column.
            p: (parameters,) values in the order of `parameters`.
            s: (state_size,) the law's own state, changed in place.
            dt: step [s].
        """
        return nan  # a MECHANISM has no law

    @staticmethod
    def torque_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the new motor torque of joint j [N m], for effects that act there too; arguments as in `law`."""
        return x[signals.TORQUE, j]

    @staticmethod
    def ahead_law(x: Array, j: int, p: Array, s: Array, dt: float) -> float:
        """Return the part of a POSITION_SENSOR law [rad] that does not depend on the torque of the same step."""
        return x[signals.MOTOR_POSITION, j]

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Change the plant's constants before a simulation (MECHANISM effects).

        Args:
            view: `view(key)` is a writable view of the plant's memory; leading dimensions are a batch.
            place: the joint.
            p: (..., parameters) with the same leading dimensions.
        """

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={value:g}" for key, value in self.values.items())
        return f"{type(self).__name__}('{self.joint}', {values})"
