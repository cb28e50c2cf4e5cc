"""The world in which the hand turns the cube: 500 Hz physics under a 10 Hz policy."""

from collections.abc import Sequence

import numpy as np

from tactile_cube.drivetrain.effects import Effect
from tactile_cube.drivetrain.signals import COMMAND, MOTOR_POSITION, POSITION, TORQUE, VELOCITY
from tactile_cube.errors import InputError
from tactile_cube.hand import DLR_HAND2, Hand, tip_positions
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start
from tactile_cube.simulation.engine import OBJECT_STATE, Contact, Engine, HandDrive, SimulationOptions
from tactile_cube.simulation.health import find_fault

_JOINT_SIGNALS = {"q": POSITION, "dq": VELOCITY, "q_m": MOTOR_POSITION, "q_d": COMMAND, "torque": TORQUE}


class World:
    """Hand and cube in the engine of the options. Joint vectors (joints,) are in the hand's order.

    An episode is a function of constants, start and actions alone: equal to the bit, whatever the world did before.

    Attributes:
        hand: The hand.
        options: Numerical choices.
        constants: Constants of the running episode.
        steps: Policy steps since the reset.
        fault: What made the physics unusable, "" while all is well.
        trace: Signals of every physics step of the last policy step, empty unless `options.trace`: `time` [s];
            `q`, `q_m`, `q_f`, `q_d` [rad], `dq` [rad/s] and `torque` [N m], each (substeps, joints); `cube_position`
            (substeps, 3) [m] and `cube_quaternion` (substeps, 4).
    """

    constants: EpisodeConstants

    def __init__(
        self, hand: Hand = DLR_HAND2, options: SimulationOptions | None = None, effects: Sequence[Effect] = ()
    ) -> None:
        """Build the bodies and the compiled control step, with further effects of the drivetrain, each at a joint.

        Raises:
            InputError: The options name no single engine.
        """
        self.hand = hand
        self.options = options or SimulationOptions()
        self.steps = 0
        self.fault = ""
        self.trace: dict[str, Array] = {}
        self._drive = HandDrive(hand, self.options, effects)
        self._engine = _make_engine(hand, self.options, self._drive)
        self._cube = np.zeros(OBJECT_STATE)
        self._push = np.zeros(6)
        self._coupled = np.array(hand.coupled(), dtype=np.int64).reshape(-1, 2)

    # --- running -------------------------------------------------------------------------------------------------

    def reset(self, constants: EpisodeConstants, start: Start) -> None:
        """Start an episode.

        Raises:
            InputError: Constants or start of another hand, or a torque loop that would be unstable with this time step.
        """
        if not constants.joints == start.angles.size == self.hand.joints:
            raise InputError(
                f"hand '{self.hand.name}' has {self.hand.joints} joints; the constants are of {constants.joints} and "
                f"the start of {start.angles.size}: take them from `constants_of(hand)` and the hand's start poses"
            )
        self.constants = constants
        self.steps, self.fault, self.trace = 0, "", {}
        self._push[:] = 0.0
        self._drive.reset(constants, start)
        self._engine.place(constants, start, self.hand.all_angles(start.angles), self.hand.all_angles(start.velocities))
        self.set_weight(constants.gravity_scale if constants.gravity_onset == 0 else 0.0)
        self._drive.sense(self._engine.q.ravel(), self._engine.v.ravel())
        self._cube = self._engine.cube_state()

    def step(self, q_n: Array) -> None:
        """Run one policy step: `options.substeps` physics steps with the desired joint angles q_n (joints,) [rad]."""
        if self.steps == self.constants.gravity_onset:
            self.set_weight(self.constants.gravity_scale)
        self._drive.view("goal")[:] = q_n - self.constants.joint_offset
        filtered, random = self._drive.view("filtered").copy(), random_wrench(self.constants, self.time)
        wrench = random + self._push if random is not None else self._push if self._push.any() else None
        states = self._engine.run(self.options.substeps, wrench, self.options.trace)
        if states is not None:
            self.trace = self._read_trace(filtered, states)
        self.steps += 1
        self._cube = self._engine.cube_state()
        self.fault = self.fault or find_fault(
            self._engine.q, self._engine.v, self._cube, self._engine.gaps(), self._coupled
        )

    def set_weight(self, scale: float) -> None:
        """Give the cube a share of its weight until changed or reset: the engine's gravity.

        The control step keeps the fingers' whole.
        """
        acceleration = scale * self.constants.gravity * self.constants.down
        self._engine.set_gravity(acceleration)
        self._drive.set_engine_gravity(acceleration)

    def push_cube(self, force: Array, torque: Array) -> None:
        """Push the cube's centre of mass with force [N] and torque [N m] in the world until changed or reset."""
        self._push[:] = np.concatenate([force, torque])

    def pull_finger(self, finger: int, force: Array) -> None:
        """Pull a fingertip with a force (3,) [N] in the world until changed or reset."""
        columns, q, width = [], self.q, 1e-6  # of the tip's velocity per joint velocity, by central differences
        for joint in range(q.size)[self.hand.of_finger(finger)]:
            delta = np.where(np.arange(q.size) == joint, width, 0.0)
            ahead, behind = tip_positions(self.hand, q + delta), tip_positions(self.hand, q - delta)
            columns.append((ahead - behind)[finger] / (2.0 * width))
        self._drive.view("external_torque")[self.hand.of_finger(finger)] = np.stack(columns, axis=1).T @ force

    def close(self) -> None:
        """End the simulation."""
        self._engine.close()

    # --- read-outs -----------------------------------------------------------------------------------------------

    @property
    def q(self) -> Array:
        """True joint angles (joints,) [rad]."""
        return self.hand.actuated(self._engine.q)

    @property
    def dq(self) -> Array:
        """True joint velocities (joints,) [rad/s]."""
        return self.hand.actuated(self._engine.v)

    @property
    def all_joint_angles(self) -> Array:
        """Angles of all joints [rad], finger by finger, coupled ones included: the joints of the hand's URDF."""
        return np.array(self._engine.q.ravel())

    @property
    def q_m(self) -> Array:
        """Measured joint angles (joints,) [rad]: motor side of the elasticity, joint offset included, without noise."""
        return np.asarray(self._drive.signal(MOTOR_POSITION) + self.constants.joint_offset)

    @property
    def q_f(self) -> Array:
        """Target after the low-pass (joints,) [rad], in what the sensors read."""
        return np.asarray(self._drive.view("filtered") + self.constants.joint_offset)

    @property
    def q_d(self) -> Array:
        """Target of the impedance law after rate and torque limits (joints,) [rad], in what the sensors read."""
        return np.asarray(self._drive.signal(COMMAND) + self.constants.joint_offset)

    @property
    def torque(self) -> Array:
        """Joint torques of the last physics step (joints,) [N m]."""
        return self._drive.signal(TORQUE)

    @property
    def cube_position(self) -> Array:
        """Centre of the cube in the world (3,) [m]."""
        return self._cube[:3]

    @property
    def cube_quaternion(self) -> Array:
        """Orientation of the cube (4,), xyzw."""
        return self._cube[3:7]

    @property
    def cube_linear_velocity(self) -> Array:
        """(3,) [m/s]."""
        return self._cube[7:10]

    @property
    def cube_angular_velocity(self) -> Array:
        """(3,) [rad/s]."""
        return self._cube[10:13]

    @property
    def tip_positions(self) -> Array:
        """Centres of the fingertip spheres in the world (fingers, 3) [m]."""
        return tip_positions(self.hand, self.q)

    @property
    def healthy(self) -> bool:
        """Whether the physics of this episode can be believed so far."""
        return not self.fault

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return self.steps * self.options.policy_dt

    def contacts(self) -> list[Contact]:
        """Return the contacts of the last physics step."""
        return self._engine.contacts()

    def normal_forces(self) -> Array:
        """Return the normal force on the object of each finger's other links and of its tip (2, fingers) [N]."""
        return self._engine.normal_forces()

    # --- parts of reset and step ---------------------------------------------------------------------------------

    def _read_trace(self, filtered: Array, states: Array) -> dict[str, Array]:
        """Return the last step's trace: q_f before it (joints,) [rad], the cube's states (substeps + 1, 13)."""
        rows, dt, offset = self._drive.view("trace"), self.options.dt, np.asarray(self.constants.joint_offset)
        trace: dict[str, Array] = {
            name: rows[:, :, row, :].reshape(len(rows), -1).copy() for name, row in _JOINT_SIGNALS.items()
        }
        # the low-pass in closed form: its goal is constant in a policy step
        left = np.exp(-np.arange(1, len(rows) + 1)[:, None] * dt / float(self._drive.view("time_constant")[0]))
        goal = self._drive.view("goal")
        trace["q_f"] = goal + left * (filtered - goal)
        for name in ("q_m", "q_d", "q_f"):  # in what the sensors read
            trace[name] = trace[name] + offset
        trace["time"] = np.asarray(self.time + dt * np.arange(len(rows), dtype=np.float64))
        trace["cube_position"], trace["cube_quaternion"] = states[:-1, :3], states[:-1, 3:7]
        return trace


def _make_engine(hand: Hand, options: SimulationOptions, drive: HandDrive) -> Engine:
    if options.single_engine == "mujoco":
        from tactile_cube.simulation.mujoco_engine import MujocoEngine

        return MujocoEngine(hand, options, drive)
    from tactile_cube.simulation.bullet_engine import BulletEngine

    return BulletEngine(hand, options, drive)


def random_wrench(constants: EpisodeConstants, time: float) -> Array | None:
    """Draw force and torque on the cube (6,) [N, N m] at a time [s] of the episode, or None without disturbances.

    Sizes and directions are redrawn at intervals, a function of the episode's seed and the time alone.
    Source: the authors' follow-up (ICRA 2023 page): N(0.04, 0.008) N, N(0.002, 0.0004) N m, every 0.5 s.
    """
    if not constants.disturbed:
        return None
    rng = np.random.default_rng((constants.force_seed, int(time / constants.force_interval + 1e-9)))
    force = rng.normal(constants.force_mean, constants.force_std) * _direction(rng)
    torque = rng.normal(constants.torque_mean, constants.torque_std) * _direction(rng)
    return np.concatenate([force, torque])


def _direction(rng: np.random.Generator) -> Array:
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
