"""What recording.yaml may say: the rig, its controller, the values its owner believes, and the trials."""

from typing import Annotated, Any, Literal

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
MOST_LATE = 64
"""Rows by which commands may be logged late."""
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
PerJoint = float | list[float] | dict[str, float]


class Coupling(Strict):
    """A joint that follows another one: q = ratio * q_joint + offset."""

    joint: str
    ratio: Number = 1.0
    offset: Number = 0.0


class Controller(Strict):
    """The impedance controller: torque = kp (q_d - q_m) - kd dq, clipped to +-torque_limit.

    Attributes:
        kp: [N m/rad], a number for all joints or one per joint.
        kd: [N m s/rad].
        torque_limit: [N m].
        mode: `position` (commands are angles) or `torque` (commands are torques [N m]; kp and kd are not used).
        rate_hz: how often the controller computes its torque; None: as often as a row is logged.
    """

    kp: PerJoint = 0.0
    kd: PerJoint = 0.0
    torque_limit: PerJoint = float("inf")
    mode: Literal["position", "torque"] = "position"
    rate_hz: Rate | None = None


class ControllerChange(Strict):
    """What one trial's controller does differently from the recording's."""

    kp: PerJoint | None = None
    kd: PerJoint | None = None
    torque_limit: PerJoint | None = None


class Sensors(Strict):
    """What is known of the sensors: resolution and standard deviation of the position [rad], of the torque [N m].

    Attributes:
        read: a row shows position and torque at the end of the control period in which its command acted (`after`), or
            at its beginning, before the command was sent (`before`).
        commands_late: rows by which commands were logged after they acted, as `diagnose` finds them.
    """

    read: Literal["after", "before"] = "after"
    commands_late: Annotated[int, Field(ge=0, le=MOST_LATE)] = 0
    position_resolution: NotNegative = 0.0
    position_noise: NotNegative = 0.0
    torque_resolution: NotNegative = 0.0
    torque_noise: NotNegative = 0.0


class KnownForce(Strict):
    """A force of known size on a link, as a weight or a spring balance gives it.

    Attributes:
        joint: the joint that carries the link (its child link in the URDF).
        point: where it acts, in that link's frame [m].
        vector: force in the rig's base frame [N].
    """

    joint: str
    point: Vector
    vector: Vector


class Touch(Strict):
    """A link is moved until it touches something whose place is known.

    Attributes:
        joint: the joint that moves.
        angle: its true angle at the touch, from the geometry of link and obstacle [rad].
    """

    joint: str
    angle: Number


class HeldObject(Strict):
    """The object that fingers hold: a box, with everything that is fixed to it.

    Attributes:
        size: edge lengths of the box [m]; one number for a cube.
        mass: of everything [kg].
        com: centre of mass of everything from the box's centre, in the box's frame [m].
    """

    size: Positive | Annotated[list[Positive], Field(min_length=3, max_length=3)]
    mass: Mass
    com: Vector = Field(default_factory=lambda: [0.0, 0.0, 0.0])

    @model_validator(mode="before")
    @classmethod
    def _known(cls, data: Any) -> Any:
        lacking = [key for key in ("size", "mass") if not isinstance(data, dict) or key not in data]
        if lacking:
            raise ValueError(f"an object needs size, its edge lengths [m], and mass [kg]; add {' and '.join(lacking)}")
        return data


class Grasp(Strict):
    """How a trial begins with the object, and what is different about the object in this trial.

    Attributes:
        position: of the box's centre in the rig's base frame when the trial starts [m].
        quaternion: its orientation in the rig's base frame, xyzw.
        released: until this time somebody or something bears the object's weight [s].
        size: of the box where it differs from the recording's [m].
        mass: likewise, as with known weights [kg].
        com: likewise, as with a weight on a lever [m].
    """

    position: Vector
    quaternion: Annotated[list[Number], Field(min_length=4, max_length=4)] = Field(
        default_factory=lambda: [0.0, 0.0, 0.0, 1.0]
    )
    released: NotNegative = 0.0
    size: Positive | Annotated[list[Positive], Field(min_length=3, max_length=3)] | None = None
    mass: Mass | None = None
    com: Vector | None = None

    @model_validator(mode="after")
    def _turned(self) -> "Grasp":
        if not any(self.quaternion):
            raise ValueError("quaternion is zero, which is no orientation; [0, 0, 0, 1] is the base frame's")
        return self


class TrialEntry(Strict):
    """One trial: its file, the robot initialisation it belongs to and the kind of excitation.

    Attributes:
        file: Parquet, CSV or NPZ file inside the recording's folder.
        initialisation: a new initialisation of the robot brings new joint offsets.
        kind: trials of the same kind repeat one command.
        controller: gains of this trial where they differ from the recording's.
        force: a known force on a static finger (bench test of kp).
        clamped: the links are held still (bench test of the drive stiffness).
        touch: a link ends at a known place (bench test of the joint offsets).
        object: the hand holds the recording's object (bench test of friction at the fingertips).
        exclude: intervals [start, end] of the file [s from its first row] that follow no model, as when somebody pushes
            the arm; what is left becomes trials of its own.
        note: free text.
    """

    file: str
    initialisation: int = 0
    kind: str = "unspecified"
    controller: ControllerChange | None = None
    force: KnownForce | None = None
    clamped: bool = False
    touch: Touch | None = None
    object: Grasp | None = None
    exclude: list[tuple[NotNegative, NotNegative]] = Field(default_factory=list)
    note: str = ""


class Description(Strict):
    """The content of recording.yaml.

    Attributes:
        rig: URDF file.
        gravity: in the rig's base frame [m/s^2].
        rate_hz: samples per second.
        joints: actuated joints in column order.
        coupled: joints that follow another one.
        nominal: what the owner believes: stiffness [N m/rad], static_friction [N m], reflected_inertia [kg m^2], ...
        object: what is held in trials that say so.
        source: where the data come from, free text.
    """

    format: Literal[1]
    rig: str = "rig.urdf"
    gravity: Vector
    rate_hz: Rate
    joints: Annotated[list[str], Field(min_length=1)]
    coupled: dict[str, Coupling] = Field(default_factory=dict)
    controller: Controller
    nominal: dict[str, PerJoint] = Field(default_factory=dict)
    sensors: Sensors = Field(default_factory=Sensors)
    object: HeldObject | None = None
    trials: Annotated[list[TrialEntry], Field(min_length=1)]
    source: str = ""

    @model_validator(mode="after")
    def _joints_once(self) -> "Description":
        twice = {joint for joint in self.joints if self.joints.count(joint) > 1}
        if twice:
            raise ValueError(f"joints names {sorted(twice)} more than once")
        return self

    @model_validator(mode="after")
    def _object_known(self) -> "Description":
        for index, trial in enumerate(self.trials):
            if trial.object is not None and self.object is None:
                raise ValueError(
                    f"trials.{index}.object: the recording does not say what is held; add a key 'object' at the "
                    "top, with size [m] and mass [kg]"
                )
        return self


def per_joint(value: PerJoint, joints: tuple[str, ...], key: str) -> NDArray[np.float64]:
    """One number per joint, shape (joints,), from a number, a list in joint order or a mapping.

    Raises:
        ValueError: a list of another length, a mapping that lacks a joint or names another one, a number that is none.
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
