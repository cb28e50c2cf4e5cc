"""The simulated hand as the control loop sees a real one: for dry runs."""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from tactile_cube.deployment.robot import Array, Reading, require_positive
from tactile_cube.deployment.training_setting import TrainingSetting
from tactile_cube.env import cube_pose
from tactile_cube.env.task import frame_along, seen_along
from tactile_cube.hand import DLR_HAND2
from tactile_cube.simulation import SimulationOptions, Start, World

AWAY = (0.0, 0.0, -0.3)  # [m] where the cube waits
LONGEST_STOP = 100_000
"""Periods for which the angle of the object is kept: a stop takes some 100, in 5 s of computing 30 000."""
NO_FILTER = 1e-9  # [s]: the loop filters, the world must not filter again


@dataclass(frozen=True)
class Disturbed:
    """Shares of the measurements that a link loses, and of the ticks that come one to five periods late."""

    lost: float = 0.0
    jitter: float = 0.0


class SimulatedHand:
    """Simulated hand whose world advances while the loop waits; arguments are those of conf/robot/simulated.yaml.

    `setting` has hand, object, table and task; None: the DLR-Hand II around the nominal cube. `cube` says whether there
    is an object to turn.
    """

    def __init__(
        self,
        rate: float = 1000.0,
        cube: bool = True,
        noise: float = 2e-4,
        resolution: float = 1e-4,
        opened: float = 0.1,
        link: Disturbed | None = None,
        timeout: float = 0.1,
        seed: int = 0,
        setting: TrainingSetting | None = None,
    ) -> None:
        require_positive({"robot.rate": rate, "robot.timeout": timeout})
        self._setting = setting or TrainingSetting.of(DLR_HAND2)
        hand = self._setting.hand
        self._world = World(hand, options=SimulationOptions(dt=1.0 / rate, substeps=1))
        self._rate, self._noise, self._resolution = rate, noise, resolution
        self.cube, self._link = cube, link or Disturbed()
        self._rng = np.random.default_rng(seed)
        self._given = self._setting.constants
        self._ticks, self._sent, self._timeout = 0, 0, round(timeout * rate)
        home = np.asarray(hand.start_angles)
        away = home - opened * np.tile([0.0, *[1.0] * (hand.joints_per_finger - 1)], len(hand.fingers))
        empty = replace(self._given, filter_time=NO_FILTER, gravity_scale=0.0, gravity_onset=0, table_height=None)
        self._world.reset(empty, Start(np.maximum(away, hand.lower), AWAY))
        self._q_d = np.array(self._world.q_m)
        self._frame, self._theta = frame_along(self._setting.task.axis_vector()), deque([0.0], LONGEST_STOP)

    def turned(self, at: float) -> float:
        """Return how far the object had been turned the wanted way when the run ended, at `at` [s], unwrapped [rad]."""
        since = min(self._ticks - round(at * self._rate), len(self._theta) - 1)
        return self._setting.task.direction * self._theta[-1 - since]

    def wait(self) -> float:
        """Advance the world by a period, by more if the tick is late."""
        late = self._rng.random() < self._link.jitter
        for _ in range(1 + (int(self._rng.integers(1, 6)) if late else 0)):
            if self._ticks - self._sent == self._timeout:  # nobody commands any more
                self._q_d = np.array(self._world.q_m)
            self._world.step(self._q_d)
            self._ticks += 1
            seen = seen_along(self._frame, self._world.cube_quaternion.tolist())
            self._theta.append(cube_pose(self._world.cube_position.tolist(), seen, self._theta[-1]).theta)
        return self._ticks / self._rate

    def read(self) -> Reading | None:
        """Return what the sensors show now, unless it is lost."""
        if self._rng.random() < self._link.lost:
            return None
        q_m = self._world.q_m + self._rng.normal(0.0, self._noise, self._world.hand.joints)
        if self._resolution > 0.0:
            q_m = np.round(q_m / self._resolution) * self._resolution
        return Reading(self._ticks / self._rate, q_m, np.array(self._world.torque))

    def send(self, q_d: Array) -> None:
        """Set the desired angles of the world's impedance controller from the next physics step on."""
        self._q_d, self._sent = np.array(q_d), self._ticks

    def wait_for_object(self) -> bool:
        """Return at once: `release` puts the object where somebody would have held it."""
        return True

    def release(self) -> None:
        """Put the object between the fingers; without a table under it, it has no weight for the first 0.4 s."""
        if self.cube:
            world, held = self._world, self._given.gravity_onset
            start = Start(np.array(world.q), target=np.array(self._q_d), velocities=np.array(world.dq))
            onset = round(0.1 * held * self._rate)
            world.reset(replace(self._given, filter_time=NO_FILTER, gravity_onset=onset), start)

    def close(self) -> None:
        """End the physics server."""
        self._world.close()
