"""Serial mechanisms of the blind world: the numbers that its physics needs and the URDF that its owner would write."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Link:
    """One moving link and the joint in front of it (axis and origin in the parent's frame, at zero angle)."""

    joint: str
    axis: tuple[float, float, float]
    origin: tuple[float, float, float]
    com: tuple[float, float, float]
    mass: float
    inertia: tuple[float, float, float]
    lower: float
    upper: float
    follows: str | None = None
    """The actuated joint this one is coupled to, one to one."""
    slides: bool = False
    """Whether the joint is prismatic: then positions are metres and efforts newtons."""
    effort: float = 10
    velocity: float = 30


@dataclass
class Rig:
    """A chain of links with some joints actuated and some coupled."""

    name: str
    links: list[Link]
    gravity: tuple[float, float, float]
    coupling_ratio: float = 1.0
    coupling_offset: float = 0.0
    tip_mass: float = 0.0
    felt: tuple[float, float, float] | None = None
    """Gravity as it is; None: as its owner states it."""
    actuated: list[str] = field(init=False)

    def __post_init__(self) -> None:
        self.actuated = [link.joint for link in self.links if link.follows is None]

    def selection(self) -> tuple[Array, Array]:
        """Matrix S (links, actuated) and offset c (links) with q_links = S q_actuated + c."""
        s = np.zeros((len(self.links), len(self.actuated)))
        c = np.zeros(len(self.links))
        for row, link in enumerate(self.links):
            if link.follows is None:
                s[row, self.actuated.index(link.joint)] = 1.0
            else:
                s[row, self.actuated.index(link.follows)] = self.coupling_ratio
                c[row] = self.coupling_offset
        return s, c

    def arrays(self) -> tuple[Array, Array, Array, Array, Array, NDArray[np.bool_]]:
        """Axes, origins, centres of mass, masses, diagonal inertias, sliding or not; tip mass included."""
        axes, origins, coms = (np.array([getattr(x, n) for x in self.links], float) for n in ("axis", "origin", "com"))
        masses = np.array([x.mass for x in self.links])
        inertias = np.array([x.inertia for x in self.links], float)
        if self.tip_mass:
            tip = 2.0 * coms[-1]
            total = masses[-1] + self.tip_mass
            shift = tip - coms[-1]
            point = masses[-1] * self.tip_mass / total * (np.dot(shift, shift) - shift**2)
            coms[-1] = (masses[-1] * coms[-1] + self.tip_mass * tip) / total
            masses[-1], inertias[-1] = total, inertias[-1] + point
        return axes, origins, coms, masses, inertias, np.array([x.slides for x in self.links])

    def urdf(self) -> str:
        """The mechanism as its owner knows it: exact coupling, no hidden mass."""
        lines = ['<?xml version="1.0"?>', f'<robot name="{self.name}">', '<link name="base"/>']
        for link in self.links:
            x, y, z = link.inertia
            lines += [
                f'<link name="{link.joint}_link"><inertial>',
                f'<origin xyz="{_xyz(link.com)}"/><mass value="{link.mass:.9g}"/>',
                f'<inertia ixx="{x:.9g}" iyy="{y:.9g}" izz="{z:.9g}" ixy="0" ixz="0" iyz="0"/></inertial></link>',
            ]
        parent = "base"
        for link in self.links:
            kind = "prismatic" if link.slides else "revolute"
            limit = f'lower="{link.lower}" upper="{link.upper}" effort="{link.effort:g}" velocity="{link.velocity:g}"'
            mimic = f'<mimic joint="{link.follows}" multiplier="1" offset="0"/>' if link.follows else ""
            lines.append(
                f'<joint name="{link.joint}" type="{kind}"><parent link="{parent}"/><child link="{link.joint}_link"/>'
                f'<origin xyz="{_xyz(link.origin)}"/><axis xyz="{_xyz(link.axis)}"/>'
                f"<limit {limit}/>{mimic}</joint>"
            )
            parent = f"{link.joint}_link"
        return "\n".join([*lines, "</robot>", ""])


def _xyz(v: tuple[float, float, float]) -> str:
    return " ".join(f"{x:.9g}" for x in v)


def _rod(mass: float, length: float, radius: float) -> tuple[float, float, float]:
    side = mass * (3 * radius**2 + length**2) / 12
    return (side, side, mass * radius**2 / 2)


def _gravity(rng: np.random.Generator) -> tuple[float, float, float]:
    """Straight down, tilted, or any direction."""
    choice = rng.integers(3)
    if choice == 0:
        return (0.0, 0.0, -9.81)
    direction = rng.normal(size=3) if choice == 1 else np.array([0, 0, -1]) + 0.35 * rng.normal(size=3)
    x, y, z = (9.81 * direction / np.linalg.norm(direction)).round(4)
    return (float(x), float(y), float(z))


def finger(rng: np.random.Generator) -> Rig:
    """Abduction, proximal and medial joint, and a distal joint that follows the medial one."""
    u = rng.uniform
    lengths = [u(0.06, 0.09), u(0.03, 0.05), u(0.03, 0.05)]
    masses = [u(0.08, 0.16), u(0.04, 0.08), u(0.025, 0.06)]
    prefix = str(rng.choice(["q", "j", "finger_joint_"]))
    names = [f"{prefix}{i}" for i in (1, 2, 3, 4)]
    knuckle = Link(names[0], (1, 0, 0), (0, 0, 0), (0, 0, 0), 0.02, (4e-6, 4e-6, 4e-6), -0.55, 0.55)
    links = [knuckle]
    below = 0.0
    ranges = [(-0.35, 1.5), (-0.18, 1.85), (-0.18, 1.85)]
    for i in range(3):
        com = (0.0, 0.0, -lengths[i] / 2)
        follows = names[2] if i == 2 else None
        rod = _rod(masses[i], lengths[i], 0.012)
        links.append(Link(names[i + 1], (0, 1, 0), (0, 0, -below), com, masses[i], rod, *ranges[i], follows=follows))
        below = lengths[i]
    return Rig("finger", links, _gravity(rng))


def pendulum(rng: np.random.Generator) -> Rig:
    """One servo with a rod, mostly hanging, sometimes on a vertical axis where gravity does nothing."""
    u = rng.uniform
    length, mass = u(0.08, 0.16), u(0.1, 0.35)
    name = str(rng.choice(["shoulder", "servo", "joint1"]))
    gravity = (0.0, -9.81, 0.0) if rng.uniform() < 0.15 else (0.0, 0.0, -9.81)
    link = Link(name, (0, 1, 0), (0, 0, 0), (0, 0, -length), mass, (1e-4, 1e-4, 1e-4), -2.8, 2.8)
    return Rig("pendulum", [link], gravity)


def two_link(rng: np.random.Generator) -> Rig:
    """A planar arm with shoulder and elbow."""
    u = rng.uniform
    lengths, masses = [u(0.08, 0.12), u(0.07, 0.11)], [u(0.1, 0.2), u(0.06, 0.14)]
    below, links = 0.0, []
    for i, name in enumerate(("shoulder", "elbow")):
        com = (0.0, 0.0, -lengths[i] / 2)
        links.append(
            Link(name, (0, 1, 0), (0, 0, -below), com, masses[i], _rod(masses[i], lengths[i], 0.01), -1.6, 1.6)
        )
        below = lengths[i]
    return Rig("arm", links, _gravity(rng))


RIGS = {"finger": finger, "pendulum": pendulum, "two_link": two_link}
