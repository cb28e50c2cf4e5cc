"""Where an episode starts in the middle of a turn: grasps that hold the object by themselves, from a file.

Fixed starts learn no finger gaiting even without gravity, starts in stable grasps learn it: Khandate et al.,
"Sampling-based Exploration for Reinforcement Learning of Dexterous Manipulation" (RSS 2023).
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube.errors import InputError
from tactile_cube.hand import Hand, grasp_angles
from tactile_cube.randomization.randomization import Array, Randomization, sample
from tactile_cube.simulation import EpisodeConstants, Start
from tactile_cube.untrusted_file import read_npz
from tactile_cube.whole_file import write_npz

MOST = 10_000  # start poses; inverse kinematics is solved for each


@dataclass(frozen=True)
class StartStates:
    """Which start poses of cube and fingers there are; each episode picks one and displaces it at random.

    Attributes:
        poses: number of poses; 1 is the published start.
        yaw_range: with several poses the cube is turned by -yaw_range .. yaw_range about the vertical [rad].
        clearance: the fingertips are then this far off their faces, by inverse kinematics [m].
    """

    poses: int = 1
    yaw_range: float = 0.0
    clearance: float = 0.001

    def __post_init__(self) -> None:
        if not 1 <= self.poses <= MOST:
            raise InputError(f"start.poses is {self.poses}; give 1 to {MOST}")
        if not 0.0 <= self.yaw_range < 0.25 * np.pi:
            raise InputError(f"start.yaw_range is {self.yaw_range} rad; give 0 to below pi/4, beyond it faces repeat")

    def of(self, hand: Hand, constants: EpisodeConstants | None = None) -> StartPoses:
        """Return the start poses of `hand` with the object of `constants`; None: the nominal cube."""
        known = constants or EpisodeConstants()
        nominal = known.object_shape == "box" and np.array_equal(known.cube_size, EpisodeConstants().cube_size)
        if self.poses == 1 and (nominal or hand.start_fixed):
            return StartPoses(hand, np.zeros(1), np.asarray(hand.start_angles, dtype=np.float64)[None])
        yaws = np.linspace(-self.yaw_range, self.yaw_range, self.poses) if self.poses > 1 else np.zeros(1)
        size, shape = np.asarray(known.cube_size), known.object_shape
        turned = Rotation.from_euler("z", yaws[:, None]).as_quat()
        angles = [grasp_angles(hand, size, np.zeros(3), turn, self.clearance, shape) for turn in turned]
        return StartPoses(hand, yaws, np.stack(angles))


@dataclass(frozen=True)
class StartPoses:
    """A table of start poses of `hand`.

    Attributes:
        yaws: angles of the cube about the vertical `(poses,)` [rad].
        angles: joint angles that go with them `(poses, joints)` [rad].
    """

    hand: Hand
    yaws: Array
    angles: Array

    def sample(self, randomization: Randomization, constants: EpisodeConstants, rng: np.random.Generator) -> Start:
        """Draw a pose and displace it.

        A cube on a table rests on it: its height and its tilt are then not displaced.
        """
        pose = int(rng.integers(len(self.yaws)))
        position = np.array([float(sample(d, rng)) for d in randomization.cube_position])
        turn = np.array([float(sample(d, rng)) for d in randomization.cube_rotation])
        angles = self.angles[pose] + sample(randomization.start_angles, rng, (self.hand.joints,))
        if constants.table_height is not None:
            position[2] = 0.0
            turn[:2] = 0.0
        return Start(
            angles=np.clip(angles, self.hand.lower, self.hand.upper),
            cube_position=position,
            cube_quaternion=Rotation.from_euler("ZYX", [self.yaws[pose] + turn[2], turn[1], turn[0]]).as_quat(),
        )


SHIPPED = Path(str(resources.files("tactile_cube"))) / "randomization" / "grasps.npz"
"""Grasps of the DLR-Hand II around the nominal cube; `tactile_cube.search_grasps` made them."""
COLUMNS = ("angles", "targets", "positions", "quaternions")


@dataclass(frozen=True)
class Grasps:
    """Stable grasps of one hand around one object.

    Attributes:
        angles: joint angles `(grasps, joints)` [rad].
        targets: what the controller holds, q_f `(grasps, joints)` [rad].
        positions: centre of the object `(grasps, 3)` [m].
        quaternions: its orientation, xyzw `(grasps, 4)`.
        hand: name of the hand.
        shape: of the object, as in `EpisodeConstants`; of a mesh a name that says which.
        size: of its bounding box (3,) [m].
        origin: how they were found: command, commit, seed, tries.
    """

    angles: Array
    targets: Array
    positions: Array
    quaternions: Array
    hand: str
    shape: str
    size: tuple[float, ...]
    origin: dict[str, str | int] = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write them as a NumPy archive; equal grasps give equal bytes."""
        path.parent.mkdir(parents=True, exist_ok=True)
        columns = {name: getattr(self, name).astype(np.float32) for name in COLUMNS}
        rest = {key: value for key, value in asdict(self).items() if key not in COLUMNS}
        write_npz(path, {"description": np.array(json.dumps(rest))} | columns)

    @classmethod
    def load(cls, path: Path) -> Grasps:
        """Read what `save` wrote. Raises InputError: there is no such file, or it is no file of grasps."""
        data = read_npz(path)
        try:
            angles, targets, positions, quaternions = (np.asarray(data[name], np.float64) for name in COLUMNS)
            rest = json.loads(str(data["description"]))
            size, origin = tuple(rest["size"]), dict(rest["origin"])
            made = cls(angles, targets, positions, quaternions, rest["hand"], rest["shape"], size, origin)
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"start.file={path}: no file of grasps ({error})") from error
        made._require_sound(path)
        return made

    def _require_sound(self, path: Path) -> None:
        count = len(self.angles)
        shapes = {"targets": self.angles.shape, "positions": (count, 3), "quaternions": (count, 4)}
        for name, shape in shapes.items():
            if count == 0 or getattr(self, name).shape != shape:
                found = getattr(self, name).shape
                raise InputError(f"start.file={path}: {name} is {found}, angles {self.angles.shape}")
        for name in COLUMNS:
            bad = np.flatnonzero(~np.isfinite(getattr(self, name)).all(axis=1))
            if bad.size:
                raise InputError(f"start.file={path}: {name}, row {bad[0]}, is not finite; search again")


@dataclass(frozen=True)
class GraspStarts:
    """Starts in stable grasps of every phase of a turn.

    Attributes:
        file: of the grasps, as `tactile_cube.search_grasps(...).save` writes it; None: the one of the package.
        share: part of the episodes that start in one; the others start as published.
    """

    file: str | None = None
    share: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.share <= 1.0:
            raise InputError(f"start.share is {self.share}; give a part above 0, at most 1")

    def of(self, hand: Hand, constants: EpisodeConstants | None = None) -> GraspTable:
        """Return the starts of `hand` with the object of `constants`; None: the nominal cube.

        Raises:
            InputError: the grasps are of another hand or another object.
        """
        known = constants or EpisodeConstants()
        path = SHIPPED if self.file is None else Path(self.file)
        grasps = Grasps.load(path)
        shape, size = str(known.object_shape), np.asarray(known.cube_size).tolist()
        if (grasps.hand, grasps.shape) != (hand.name, shape) or not np.allclose(grasps.size, size):
            raise InputError(
                f"start.file={path}: grasps of hand {grasps.hand} and a {grasps.shape} of {list(grasps.size)} m, "
                f"not of {hand.name} and a {shape} of {size} m; search with tactile_cube.search_grasps"
            )
        return GraspTable(hand, grasps, self.share, StartStates().of(hand, known))


@dataclass(frozen=True)
class GraspTable:
    """A table of grasps of `hand`, in which a `share` of the episodes start; the `others` have poses of their own."""

    hand: Hand
    grasps: Grasps
    share: float
    others: StartPoses

    def sample(self, randomization: Randomization, constants: EpisodeConstants, rng: np.random.Generator) -> Start:
        """Draw a start; a grasp is taken as it was found, because displacing its parts would loosen it.

        Raises:
            InputError: the object lies on a table.
        """
        if constants.table_height is not None:
            raise InputError("start=grasps holds the object in the air, the task has a table; choose start=wide_yaw")
        if rng.random() >= self.share:
            return self.others.sample(randomization, constants, rng)
        row, grasps = int(rng.integers(len(self.grasps.angles))), self.grasps
        return Start(
            angles=np.clip(grasps.angles[row], self.hand.lower, self.hand.upper),
            cube_position=grasps.positions[row],
            cube_quaternion=grasps.quaternions[row],
            target=grasps.targets[row] + constants.joint_offset,
        )
