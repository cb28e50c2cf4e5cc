"""Run one episode and write down everything that happens in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tensordict import TensorDictBase
from torchrl.envs import TransformedEnv

from tactile_cube.env import OUTCOMES, RotationEnv
from tactile_cube.evaluation.episode_record import Array, ContactTable, EpisodeRecord
from tactile_cube.evaluation.policies import Policy
from tactile_cube.simulation import EpisodeConstants
from tactile_cube.transforms import JointOffset

Interference = Callable[[RotationEnv, int], None]
"""Something done to the world before each policy step, given the number of the step."""


def run_episode(
    env: TransformedEnv, policy: Policy, seed: int, interference: Interference | None = None
) -> EpisodeRecord:
    """Run one episode in an environment with one world.

    Args:
        env: what `make_env(config, 1, seed)` gave.
        policy: what decides.
        seed: start, randomisation, noise and sticky actions are drawn from it; equal seeds give equal episodes.
        interference: disturbs the world, e.g. pulls at a finger.
    """
    env.set_seed(seed)
    state = env.reset()
    task: RotationEnv = env.base_env.tasks[0]
    policy.start(task, seed)
    recorder = Recorder(env)
    finished, step = False, 0
    while not finished:
        if interference is not None:
            interference(task, step)
        observation = state["observation"][0].numpy()
        action = policy.act(observation, step)
        recorder.decided(observation, action)
        state["action"] = state["observation"].new_tensor(action)[None]
        state = env.step(state)["next"]
        recorder.add(state)
        finished, step = bool(state["done"][0, 0]), step + 1
    return recorder.record(seed)


class Recorder:
    """Gathers the samples of an episode as it runs in an environment with one world; made after its reset."""

    def __init__(self, env: TransformedEnv) -> None:
        task: RotationEnv = env.base_env.tasks[0]
        offset = next(part.offset for part in env.transform if isinstance(part, JointOffset))
        self._task, self._joint_offset = task, np.broadcast_to(offset.double().numpy(), (1, task.hand.joints))[0]
        self._fingers = tuple(finger.name for finger in task.hand.fingers)
        self._tips = [task.hand.fingers[finger].links[-1] for finger in range(len(self._fingers))]
        self._rows: dict[str, list[Array]] = {name: [] for name in WORLD_SIGNALS}
        self._contacts: list[tuple[int, int, bool, Array, Array, float, float]] = []
        self._trace: list[dict[str, Array]] = []
        self._theta, self._reward = [0.0], list[float]()
        self._terms, self._targets = list[Array](), list[Array]()
        self._policy: dict[str, list[Array]] = {}
        self._outcome = 0
        self._sample()

    def decided(self, observation: NDArray[np.float32], action: Array) -> None:
        """Take over what the policy was given, a stack of readings, and the action `(joints,)` it asked for."""
        joints = self._task.hand.joints
        newest = np.array(observation[-2 * joints :], dtype=np.float64)
        values = (newest[:joints], newest[joints:], np.array(action, dtype=np.float64))
        for name, value in zip(POLICY_SIGNALS, values, strict=True):
            self._policy.setdefault(name, []).append(value)

    def add(self, state: TensorDictBase) -> None:
        """Take over one policy step that has just been made."""
        self._theta.append(float(state["theta"][0, 0]))
        self._reward.append(float(state["reward"][0, 0]))
        self._terms.append(state["reward_terms"][0].double().numpy())
        self._targets.append(self._task.target + self._joint_offset)
        self._outcome = int(state["outcome"][0, 0])
        if self._task.world.options.trace:
            self._trace.append({name: np.array(values) for name, values in self._task.world.trace.items()})
        self._sample()

    def record(self, seed: int) -> EpisodeRecord:
        """Return the episode so far."""
        task, samples = self._task, len(self._theta)
        weights = task.reward.weights(task.conditions.penalty_scale)
        terms = np.array(self._terms).reshape(-1, len(weights)) * weights
        names = self._trace[0] if self._trace else {}
        return EpisodeRecord(
            time=np.arange(samples, dtype=np.float64) * task.world.options.policy_dt,
            theta=np.array(self._theta),
            joint_position=np.array(self._rows["q"]),
            filtered_target=np.array(self._rows["q_f"]),
            target=np.array(self._targets).reshape(-1, task.hand.joints),
            cube_position=np.array(self._rows["cube_position"]),
            cube_quaternion=np.array(self._rows["cube_quaternion"]),
            reward=np.array(self._reward),
            reward_terms={name: terms[:, index] for index, name in enumerate(task.reward.terms)},
            contacts=self._contact_table(),
            ending=OUTCOMES[self._outcome],
            direction=task.task.direction,
            cube_size=np.array(task.constants.cube_size),
            constants={"seed": float(seed), **_numbers(task.constants)},
            fingers=self._fingers,
            object_shape=task.constants.object_shape,
            axis=tuple(task.task.axis_vector().tolist()),
            trace={name: np.concatenate([piece[name] for piece in self._trace]) for name in names},
            policy={name: np.array(rows) for name, rows in self._policy.items()},
        )

    def _sample(self) -> None:
        world, sample = self._task.world, len(self._theta) - 1
        for name, rows in self._rows.items():
            rows.append(np.array(getattr(world, name)))
        for contact in world.contacts():
            if contact.other == "cube" and contact.finger in self._fingers:
                force = contact.force * contact.normal + contact.friction
                finger = self._fingers.index(contact.finger)
                tip = contact.link == self._tips[finger]
                self._contacts.append((sample, finger, tip, contact.position, force, contact.force, contact.distance))

    def _contact_table(self) -> ContactTable:
        step, finger, tip, position, force, normal, distance = (
            zip(*self._contacts, strict=True) if self._contacts else ((),) * 7
        )
        return ContactTable(
            step=np.array(step, dtype=np.int64),
            finger=np.array(finger, dtype=np.int64),
            tip=np.array(tip, dtype=np.bool_),
            position=np.array(position, dtype=np.float64).reshape(-1, 3),
            force=np.array(force, dtype=np.float64).reshape(-1, 3),
            normal_force=np.array(normal, dtype=np.float64),
            distance=np.array(distance, dtype=np.float64),
        )


NO_NUMBERS = ("effects", "joints", "object_shape")
POLICY_SIGNALS = ("q_m", "e_q", "action")
WORLD_SIGNALS = ("q", "q_f", "cube_position", "cube_quaternion")


def _numbers(constants: EpisodeConstants) -> dict[str, float | str]:
    """Return the scalar constants of the episode for its label; vectors over the joints by their mean."""
    fields = (field.name for field in dataclasses.fields(constants) if field.name not in NO_NUMBERS)
    values = {name: getattr(constants, name) for name in fields}
    return {name: float(np.mean(value)) for name, value in values.items() if value is not None}
