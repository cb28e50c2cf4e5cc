"""What recording.yaml may say: the rig, its controller, the values its owner believes, and the trials."""

from collections import Counter
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tactile_cube import limits
from tactile_cube.drivetrain.model_file import Strict

Number = Annotated[float, Field(ge=-limits.NUMBER, le=limits.NUMBER, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Mass = Annotated[Positive, Field(le=limits.MASS)]
Rate = Annotated[Positive, Field(le=limits.RATE)]
MOST_LATE = 64  # rows by which commands may be logged late
Size = Positive | Annotated[list[Positive], Field(min_length=3, max_length=3)]
"""Edge lengths of a box [m]; one number for a cube."""
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
PerJoint = float | list[float] | dict[str, float]


class Coupling(Strict):
    """A joint that follows another one: q = ratio * q_joint + offset."""

    joint: str
    ratio: Number = 1.0
    offset: Number = 0.0


class Controller(Strict):
    """The impedance controller: torque = kp (q_d - q_m) - kd dq, clipped to +-torque_limit."""

    kp: PerJoint = 0.0  # [N m/rad], a number for all joints or one per joint
    kd: PerJoint = 0.0  # [N m s/rad]
    torque_limit: PerJoint = float("inf")  # [N m]
    # torque: commands are torques [N m]; kp and kd are not used. voltage: so much of a motor's voltage, kt / R u [N m],
    # beside which kd, kt^2 / R of its back-EMF, acts
    mode: Literal["position", "torque", "voltage"] = "position"
    rate_hz: Rate | None = None  # how often it computes its torque; None: not known, so all the time


class ControllerChange(Strict):
    """What one trial's controller does differently from the recording's."""

    kp: PerJoint | None = None
    kd: PerJoint | None = None
    torque_limit: PerJoint | None = None


class Sensors(Strict):
    """When a row was read, and resolution and standard deviation of the position [rad] and of the torque [N m]."""

    read: Literal["after", "before"] = "after"  # at the end of the control period in which its command acted, or before
    commands_late: Annotated[int, Field(ge=0, le=MOST_LATE)] = 0  # rows by which commands were logged after they acted
    position_resolution: NotNegative = 0.0
    position_noise: NotNegative = 0.0
    torque_resolution: NotNegative = 0.0
    torque_noise: NotNegative = 0.0


class KnownForce(Strict):
    """A force of known size on a link, as a weight or a spring balance gives it."""

    joint: str  # that carries the link (its child link in the URDF)
    point: Vector  # where it acts, in that link's frame [m]
    vector: Vector  # in the rig's base frame [N]


class Touch(Strict):
    """A link is moved until it touches something whose place is known."""

    joint: str  # that moves
    angle: Number  # its true angle at the touch, from the geometry of link and obstacle [rad]


class HeldObject(Strict):
    """The object that fingers hold: a box, with everything that is fixed to it."""

    size: Size
    mass: Mass  # of everything [kg]
    com: Vector = Field(default_factory=lambda: [0.0, 0.0, 0.0])  # from the box's centre, in the box's frame [m]


class Grasp(Strict):
    """How a trial begins with the object, and what is different about the object in this trial."""

    position: Vector  # of the box's centre in the rig's base frame when the trial starts [m]
    quaternion: Annotated[list[Number], Field(min_length=4, max_length=4)] = Field(
        default_factory=lambda: [0.0, 0.0, 0.0, 1.0]
    )  # its orientation in the rig's base frame, xyzw
    released: NotNegative = 0.0  # until this time somebody or something bears the object's weight [s]
    size: Size | None = None  # where it differs from the recording's
    mass: Mass | None = None  # likewise, as with known weights [kg]
    com: Vector | None = None  # likewise, as with a weight on a lever [m]

    @model_validator(mode="after")
    def _turned(self) -> "Grasp":
        if not any(self.quaternion):
            raise ValueError("quaternion is zero, which is no orientation; [0, 0, 0, 1] is the base frame's")
        return self

    def of(self, held: HeldObject) -> Self:
        """Return the grasp of the recording's object, with its values where none differ."""
        return self.model_copy(update={key: value for key, value in held if getattr(self, key) is None})


class TrialEntry(Strict):
    """One trial."""

    file: str  # Parquet, CSV or NPZ, inside the recording's folder
    initialisation: int = 0  # a new initialisation of the robot brings new joint offsets
    kind: str = "unspecified"  # of excitation: trials of the same kind repeat one command
    controller: ControllerChange | None = None
    force: KnownForce | None = None  # on a static finger (bench test of kp)
    clamped: bool = False  # the links are held still (bench test of the drive stiffness)
    touch: Touch | None = None  # a link ends at a known place (bench test of the joint offsets)
    object: Grasp | None = None  # the hand holds the recording's object (bench test of friction at the fingertips)
    # intervals of the file [s from its first row] that follow no model; what is left becomes trials of its own
    exclude: list[tuple[NotNegative, NotNegative]] = Field(default_factory=list)
    unjudged: NotNegative = 0.0  # [s] at its start that count in no error, as they follow commands before the log
    note: str = ""


class Description(Strict):
    """The content of recording.yaml."""

    format: Literal[1]
    rig: str = "rig.urdf"
    gravity: Vector  # in the rig's base frame [m/s^2]
    rate_hz: Rate  # samples per second
    joints: Annotated[list[str], Field(min_length=1)]  # actuated, in column order
    coupled: dict[str, Coupling] = Field(default_factory=dict)
    controller: Controller
    # what the owner believes: stiffness [N m/rad], static_friction [N m], reflected_inertia [kg m^2], ...
    nominal: dict[str, PerJoint] = Field(default_factory=dict)
    sensors: Sensors = Field(default_factory=Sensors)
    object: HeldObject | None = None  # what is held in trials that say so
    trials: Annotated[list[TrialEntry], Field(min_length=1)]
    source: str = ""  # where the data come from
    # what nobody states; the numbers given for it are guesses, and identification begins with them
    unknown: list[Literal["kp", "kd", "reflected_inertia", "mass"]] = Field(default_factory=list)
    shown_in: dict[str, Literal["deg"]] = Field(default_factory=dict)  # joints whose log is in degrees
    doubts: list[str] = Field(default_factory=list)  # what the import could not prove, and what it left out

    @model_validator(mode="after")
    def _consistent(self) -> "Description":
        twice = {joint for joint, count in Counter(self.joints).items() if count > 1}
        if twice:
            raise ValueError(f"joints names {sorted(twice)} more than once")
        holding = [index for index, trial in enumerate(self.trials) if trial.object is not None]
        if holding and self.object is None:
            raise ValueError(
                f"trials.{holding[0]}.object: the recording does not say what is held; add a key 'object' at the "
                "top, with size [m] and mass [kg]"
            )
        return self


def per_joint(value: PerJoint, joints: tuple[str, ...], key: str) -> NDArray[np.float64]:
    """Convert a number, a list in joint order or a mapping to one value per joint, shape (joints,).

    Raises:
        ValueError: a list of another length, a mapping that lacks a joint or names another one, nan, too large a value.
    """
    if isinstance(value, dict):
        if set(value) != set(joints):
            raise ValueError(f"key '{key}': expected one number for each of {list(joints)}, received {value}")
        value = [value[joint] for joint in joints]
    if isinstance(value, list) and len(value) != len(joints):
        raise ValueError(f"key '{key}': expected one number for all joints or {len(joints)}, received {value}")
    numbers = np.broadcast_to(np.asarray(value, dtype=np.float64), (len(joints),)).copy()
    wrong = ~(np.isinf(numbers) | (np.abs(numbers) <= limits.NUMBER))
    if wrong.any():
        raise ValueError(
            f"key '{key}': received {numbers[wrong][0]:g} for {joints[int(np.argmax(wrong))]}; expected numbers up to "
            f"{limits.NUMBER:g}, or .inf"
        )
    return numbers
