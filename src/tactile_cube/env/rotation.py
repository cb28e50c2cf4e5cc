"""The rotation task in one world, at 10 Hz, in plain numpy: every learner's environment is made of this one."""

import math
from dataclasses import dataclass

import numpy as np

from tactile_cube.env.reward import Reward, Step
from tactile_cube.env.task import FAULTY, LOST, RUNNING, TIME_LIMIT, CubePose, Task, cube_pose, frame_along, seen_along
from tactile_cube.hand import DLR_HAND2, Hand, tip_positions
from tactile_cube.randomization import GraspTable, Randomization, StartPoses, drawn_places
from tactile_cube.simulation import EpisodeConstants, World
from tactile_cube.simulation.constants import Array

OBJECT = 13  # numbers of the object in what only critics see; q_f follows


@dataclass(slots=True)
class TimeStep:
    """Result of a reset or a policy step.

    Attributes:
        joint_position: q_m as the policy sees it, before sensor noise `(joints,)` [rad].
        control_error: e_q = q_f - q_m `(joints,)` [rad].
        object_state: what only the critic may see `(13 + joints,)`: cube position (3) [m], sin 4theta, cos 4theta, phi,
            psi, linear velocity (3) [m/s], angular velocity (3) [rad/s], q_f (joints) [rad]. Source: paper, section II.
        theta: rotation since the start in the rewarded direction, unwrapped [rad].
        reward_terms: the terms before weighing, in the order of `Reward.terms`.
        reward: their weighted sum.
        outcome: index into OUTCOMES; anything but 0 ends the episode.
        step: policy steps since the start.
    """

    joint_position: Array
    control_error: Array
    object_state: Array
    theta: float
    reward_terms: Array
    reward: float
    outcome: int
    step: int

    @property
    def terminated(self) -> bool:
        """Whether the cube was lost."""
        return self.outcome in LOST

    @property
    def truncated(self) -> bool:
        """Whether the episode ends for a reason outside the task: the time limit or faulty physics."""
        return self.outcome in (TIME_LIMIT, FAULTY)


class RotationEnv:
    """Rotation task of one hand and one cube.

    Every episode draws from a generator of its own, made of the seed, the world's index and the episode's number, so
    that what happens in it depends on nothing else.

    Attributes:
        constants: of the running episode.
        conditions: of the next episode.
        steered: names of the constants that are drawn by `odds`.
        odds: probability of each part of their ranges, in the next episode.
        places: where in their ranges they lie in the running episode, each in [0, 1).
        target: q_n of the last step `(joints,)` [rad].

    Example:
        >>> env = RotationEnv(World(), Task("table"), Reward(), Randomization(), StartStates().of(DLR_HAND2))
        >>> moment = env.reset()
        >>> while not (moment.terminated or moment.truncated):
        ...     moment = env.step(np.zeros(12))
    """

    def __init__(
        self,
        world: World,
        task: Task,
        reward: Reward,
        randomization: Randomization,
        start: StartPoses | GraspTable,
        constants: EpisodeConstants | None = None,
        hand: Hand = DLR_HAND2,
    ) -> None:
        """Create the task in `world`, whose hand is `hand`; `constants` are nominal, None: the published ones."""
        self.world, self.task, self.reward, self.randomization, self.hand = world, task, reward, randomization, hand
        self.nominal = EpisodeConstants() if constants is None else constants
        self.start_poses = start
        self._frame = frame_along(task.axis_vector())
        self.conditions = task.conditions()
        unknown = randomization.learnability(self.nominal)
        self.steered, self.odds = tuple(unknown.ranges), unknown.odds
        self.places = np.zeros(len(self.steered))
        self.constants = self.nominal
        self.target = np.asarray(hand.start_angles, dtype=np.float64)
        self._middle = 0.5 * (np.asarray(hand.action_lower) + np.asarray(hand.action_upper))
        self._half_range = 0.5 * (np.asarray(hand.action_upper) - np.asarray(hand.action_lower))
        self.seed(0)

    def seed(self, seed: int, index: int = 0) -> None:
        """Reset the episode counter; `index` separates worlds with the same seed."""
        self._seed, self._index, self._episode = seed, index, 0

    def reset(self) -> TimeStep:
        """Start the next episode."""
        rng = np.random.default_rng([self._seed, self._index, self._episode])
        self._episode += 1
        self.places = drawn_places(self.odds, rng)
        places = dict(zip(self.steered, self.places.tolist(), strict=True))
        drawn = self.randomization.constants(self.nominal, rng, places)
        self.constants = self.task.apply(drawn, self.conditions)
        self.world.reset(self.constants, self.start_poses.sample(self.randomization, self.constants, rng))
        self._weights = self.reward.weights(self.conditions.penalty_scale)
        self._limit = self.reward.fastest * self.world.options.policy_dt
        self._first = self._pose = self._pose_now(None)
        self._began = self._azimuths()
        self._tips = np.zeros_like(self._began)
        self._moment = self._observe(np.zeros(len(self.reward.terms)), RUNNING, 0)
        return self._moment

    def step(self, action: Array) -> TimeStep:
        """Run a policy step of 0.1 s; desired joint angles: `action` (joints,) in [-1, 1], scaled to the action range.

        Faulty physics ends the episode: the step repeats the last sound state with no reward.
        """
        self.target = self._middle + self._half_range * action
        self.world.step(self.target)
        step = self._moment.step + 1
        if self.world.healthy:
            before = self._pose
            self._pose = self._pose_now(before.theta)
            outcome = self.task.outcome(self._first, self._pose, step)
            moment = self._observe(self._measure(before, self._pose, outcome), outcome, step)
            if math.isfinite(moment.reward + float(moment.object_state.sum() + moment.joint_position.sum())):
                self._moment = moment
                return moment
        last, nothing = self._moment, np.zeros(len(self.reward.terms))
        state = (last.joint_position, last.control_error, last.object_state, last.theta)
        self._moment = TimeStep(*state, nothing, 0.0, FAULTY, step)
        return self._moment

    def _pose_now(self, previous_theta: float | None) -> CubePose:
        quaternion = seen_along(self._frame, self.world.cube_quaternion.tolist())
        return cube_pose(self.world.cube_position.tolist(), quaternion, previous_theta)

    def _azimuths(self) -> Array:
        """Return the azimuths of the fingertips about the object (fingers,) [rad]."""
        places = tip_positions(self.hand, self.world.q) - self.world.cube_position
        places = places if self._frame is None else self._frame.inv().apply(places)
        return np.arctan2(places[:, 1], places[:, 0])

    def _measure(self, before: CubePose, after: CubePose, outcome: int) -> Array:
        azimuths = self._tips
        self._tips = np.remainder(self._azimuths() - self._began + np.pi, 2.0 * np.pi) - np.pi
        step = Step(
            first=self._first,
            before=before,
            after=after,
            direction=self.task.direction,
            limit=self._limit,
            lost=outcome in LOST,
            proximal_angles=self.world.q[:: self.hand.joints_per_finger].tolist(),
            azimuths_before=azimuths,
            azimuths=self._tips,
            forces=self.world.normal_forces(),
        )
        return self.reward.measure(step)

    def _observe(self, measured: Array, outcome: int, step: int) -> TimeStep:
        world, pose = self.world, self._pose
        q_m, q_f = world.q_m, world.q_f
        state = np.empty(OBJECT + q_f.size)
        yaw = self.task.symmetry * pose.theta
        state[:7] = (pose.x, pose.y, pose.z, math.sin(yaw), math.cos(yaw), pose.phi, pose.psi)
        state[7:10] = world.cube_linear_velocity
        state[10:13] = world.cube_angular_velocity
        state[OBJECT:] = q_f
        theta = self.task.direction * (pose.theta - self._first.theta)
        reward = float(measured @ self._weights)
        return TimeStep(np.array(q_m), q_f - q_m, state, theta, measured, reward, outcome, step)
