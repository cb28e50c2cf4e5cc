"""The drivetrain of all fingers in the world: constants of an episode into the memory of the compiled control step."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactile_cube.drivetrain import DrivetrainConstants, Plant, check_damping_stability
from tactile_cube.drivetrain.effects import Effect
from tactile_cube.drivetrain.plant import CONSTANT_KEYS
from tactile_cube.hand import Hand
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.hand.urdf import with_inertias
from tactile_cube.simulation.constants import Array, EpisodeConstants, Start
from tactile_cube.simulation.engine import SimulationOptions


class HandDrive:
    """Control step and its memory for the fingers of a hand.

    Attributes:
        plant: The compiled control step of all fingers and the layout of its memory.
        memory: The numbers it works on; the same array for good.
    """

    def __init__(self, hand: Hand, options: SimulationOptions, effects: Sequence[Effect]) -> None:
        self._hand, self._engine = hand, options.single_engine
        self._effects = list(effects)
        self._urdfs = [hand.finger_urdf(k) for k in range(len(hand.fingers))]
        known = {text: RigidBodyTree.from_urdf(text) for text in dict.fromkeys(self._urdfs)}
        self._trees = [known[text] for text in self._urdfs]
        self._shares = spin_shares(self._trees[0])
        self.plant = Plant(
            trees=self._trees,
            dt=options.dt,
            effects=tuple(dict.fromkeys(type(effect) for effect in effects)),
            joint_names=hand.joint_names,
            trace_rows=options.substeps if options.trace else 0,
        )
        self.memory = self.plant.memory(DrivetrainConstants(), effects=self._effects)

    def finger_urdfs(self) -> list[str]:
        """URDF text of each finger, with the masses that effects on the mechanism have changed."""
        mass, com, inertia = (self.view(key) for key in ("mass", "com", "inertia"))
        texts = []
        for k, (text, tree) in enumerate(zip(self._urdfs, self._trees, strict=True)):
            same = np.array_equal(mass[k], tree.mass) and np.array_equal(com[k], tree.com)
            changed = (self._hand.fingers[k].links, mass[k], com[k], inertia[k])
            texts.append(text if same else with_inertias(text, *changed))
        return texts

    def reset(self, c: EpisodeConstants, start: Start) -> None:
        """Fills the memory for an episode and puts it at rest at the start.

        Raises:
            InputError: The torque loop would be unstable with these constants and this time step.
        """
        named = {key: getattr(c, key) for key in CONSTANT_KEYS if key != "compliance"} | {"stiffness": c.stiffness}
        constants = DrivetrainConstants(**named, sign="physical" if c.elasticity_sign > 0 else "printed")
        self._refuse_unstable(constants)
        gravity = self._in_bases(c.gravity * c.down)
        self.memory[:] = self.plant.memory(constants, gravity=gravity, effects=[*self._effects, *c.effects])
        self.view("friction_creep")[:] = c.friction_creep
        self.view("time_constant")[:] = c.filter_time
        if self._engine == "mujoco":  # its own rotors and tendons
            rotors = self.view("reflected_inertia").reshape(-1, self._hand.joints_per_finger)
            self.view("armature")[:, list(self.plant.topology.leader)] = rotors
        else:  # numerical aids that the torques know of
            self.view("spin_inertia")[:] = spin_inertia(self._hand, self._shares, np.asarray(c.reflected_inertia))
            self.view("tendon_stiffness")[:] = TENDON_STIFFNESS
            self.view("tendon_damping")[:] = TENDON_DAMPING
        self.plant.reset(self.memory, start.angles, v=start.velocities)
        for key in ("filtered", "limited", "goal"):
            self.view(key)[:] = start.angles if start.target is None else start.target - c.joint_offset

    def view(self, key: str) -> Array:
        """Writable numbers of the memory."""
        return self.plant.view(self.memory, key)

    def signal(self, row: int) -> Array:
        """A signal of the last physics step (joints,)."""
        return self.plant.signal(self.memory, row)

    def set_engine_gravity(self, acceleration: Array) -> None:
        """Tells the control step what gravity the engine applies (3,) [m/s^2]; the fingers keep feeling their own."""
        self.view("engine_gravity")[:] = self._in_bases(acceleration)

    def sense(self, q: Array, v: Array) -> None:
        """Computes what the sensors read at rest at q, v (all joints,), without changing any state."""
        trial = self.memory.copy()
        self.plant.kernel.control_step(0, q.copy(), v.copy(), np.zeros_like(q), trial)
        self.view("signals")[:] = self.plant.view(trial, "signals")

    def _refuse_unstable(self, c: DrivetrainConstants) -> None:
        """Raises InputError if a finger with the largest damping and smallest inertia of each joint would diverge."""
        of_fingers = {
            name: np.reshape(getattr(c, name), (-1, self._hand.joints_per_finger))
            for name in ("kp", "kd", "stiffness", "reflected_inertia")
        }
        weakest = {name: values.max(axis=0) for name, values in of_fingers.items()}
        weakest |= {name: of_fingers[name].min(axis=0) for name in ("stiffness", "reflected_inertia")}
        for tree in {id(tree): tree for tree in self._trees}.values():
            check_damping_stability(tree, replace(c, static_friction=0.0, **weakest), self.plant.dt)

    def _in_bases(self, vector: Array) -> Array:
        """A world vector in the frame of each finger's base (fingers, 3)."""
        rotations = [self._hand.base_in_world(k)[1] for k in range(len(self._hand.fingers))]
        return np.stack([rotation.T @ vector for rotation in rotations])


LEAST_INERTIA = 1e-3  # reflected inertia below which spin inertia is not lowered further [kg m^2]
TENDON_STIFFNESS = 15.0  # spring that holds q4 at q3 [N m/rad]
TENDON_DAMPING = 0.02  # its damping [N m s/rad]; stable while k dt^2 w + 2 d dt w < 4 with w = (J3 + 4 J4) / (J3 J4)


PARALLEL = 0.99  # cosine of the angle between axes from which on they count as parallel


def spin_inertia(hand: Hand, shares: Array, reflected_inertia: Array) -> Array:
    """Spin inertia of each link about its joint (fingers, links), from I_a of the joints (joints,) [kg m^2]."""
    return np.asarray(np.maximum(hand.all_angles(reflected_inertia), LEAST_INERTIA) * shares)


def spin_shares(tree: RigidBodyTree) -> Array:
    """Share of a joint's reflected inertia that its link spins with (links,).

    Joints in a row with parallel axes share it, for all further links turn with the first of them: three of them take
    1/2, 1/3 and 1/6.
    """
    groups: list[int] = []
    turn, before = np.eye(3), np.zeros(3)
    for k in range(tree.dofs):
        turn = turn @ tree.placement_rotation[k]
        axis = turn @ tree.axis[k]
        if groups and abs(float(axis @ before)) > PARALLEL:
            groups[-1] += 1
        else:
            groups.append(1)
        before = axis
    return np.concatenate([np.arange(count, 0, -1) / (count * (count + 1) // 2) for count in groups])
