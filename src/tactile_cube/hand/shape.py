"""Collision shapes of links in plain numbers, which every engine can build."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """A convex shape in a link's frame.

    Attributes:
        kind: what it is.
        size: of a box its edges (3,), of a cylinder or capsule radius and length of the straight part (2,), of a sphere
            its radius (1,), of a mesh its scale (3,).
        position: of its middle (3,) [m].
        rotation: of its axes (3, 3); cylinders and capsules lie along z.
        file: of a mesh.
    """

    kind: Literal["box", "cylinder", "capsule", "sphere", "mesh"]
    size: tuple[float, ...]
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    file: str = ""
