"""Links of a robot in Rerun as solid bodies."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import rerun as rr
from rerun.urdf import UrdfTree

SHAPES: dict[str, Any] = {"box": rr.Boxes3D, "cylinder": rr.Cylinders3D, "sphere": rr.Ellipsoids3D}


def fill_shapes(stream: rr.RecordingStream, tree: UrdfTree, urdf: str) -> None:
    """Draw the links solid; the importer draws cylinders, spheres and boxes as translucent wire frames."""
    for link in ElementTree.fromstring(urdf).iter("link"):
        paths = tree.get_visual_geometry_paths(str(link.get("name")))
        for path, visual in zip(paths, link.findall("visual"), strict=True):
            for tag, archetype in SHAPES.items():
                if visual.find(f"geometry/{tag}") is not None:
                    stream.log(path, archetype.from_fields(fill_mode="solid"), static=True)
