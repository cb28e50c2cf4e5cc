"""Files that a URDF names: those below its folder are taken, and none that these name elsewhere."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_tree import robot_of
from tactile_cube.untrusted_file import below, regular

SHAPES = ("visual", "collision")
MESHES = (".obj", ".stl")
PARTS = re.compile(r"^\s*(?:mtllib|map_\w+|bump|disp|decal|refl|norm)\s(.+)$", re.MULTILINE | re.IGNORECASE)
"""Lines of an OBJ file that name materials, and of a material that name pictures."""


def with_own_files(urdf: str, file: Path, root: Path, shapes: tuple[str, ...] = SHAPES) -> tuple[str, list[str]]:
    """Return a URDF whose files all lie below a folder and have absolute names.

    Args:
        urdf: the text.
        file: that it was read from, which names are relative to.
        root: folder of the robot's files, which `package://NAME/` stands for.
        shapes: kinds to keep.

    Returns:
        The text without shapes whose files lie elsewhere or are not there, and why each was left out.

    Raises:
        InputError: no URDF, or elements nested too deeply.
    """
    robot, left_out = robot_of(urdf), []
    waiting = [robot]
    while waiting:
        parent = waiting.pop()
        for child in list(parent):
            tag = _local(child.tag)
            if tag in SHAPES and tag not in shapes:
                parent.remove(child)
                continue
            try:
                _make_absolute(child, file.parent, root, f"{file}: link '{parent.get('name')}'")
            except InputError as error:
                parent.remove(child)
                left_out.append(str(error))
            else:
                waiting += [] if tag in SHAPES else [child]
    try:
        return ElementTree.tostring(robot, encoding="unicode"), left_out
    except RecursionError:
        raise InputError(f"{file}: its elements are nested too deeply") from None


def package_of(urdf: Path) -> Path:
    """Return the folder whose files a URDF may name: that of its ROS package, else its own."""
    folder = urdf.resolve().parent
    return next((one for one in (folder, *folder.parents[:2]) if (one / "package.xml").is_file()), folder)


def require_mesh(file: Path, where: str) -> None:
    """Refuse a mesh that no engine reads, and one with materials or pictures from elsewhere: films would show them.

    Raises:
        InputError: naming it.
    """
    if file.suffix.lower() not in MESHES:
        raise InputError(f"URDF: {where} has the mesh {file}; convert it to {' or '.join(MESHES)}")
    if file.suffix.lower() == ".obj":
        for material in _require_parts(file):
            if material.exists():
                _require_parts(regular(material, limits.TEXT))


def _require_parts(file: Path) -> list[Path]:
    """Files that an OBJ file or a material names, all below its folder."""
    lines = PARTS.findall(file.read_text(encoding="utf-8", errors="replace"))
    return [below(file.parent, word, str(file)) for line in lines for word in line.split()]


def _make_absolute(element: ElementTree.Element, folder: Path, root: Path, where: str) -> None:
    """Of a shape all files that it names; of another element that which it names itself."""
    for part in element.iter() if _local(element.tag) in SHAPES else (element,):
        if _local(part.tag) == "filename":  # as some readers have it
            raise InputError(f"{where}: <filename> is an attribute; write filename=")
        for key, name in part.items():
            if _local(key) == "filename":
                inside = name.startswith("package://")
                name = name.removeprefix("package://").partition("/")[2] if inside else name
                file = below(root if inside else folder, name, f"{where}, <{_local(part.tag)}>", root)
                part.set(key, str(regular(file, limits.MESH).resolve()))


def _local(name: str) -> str:
    return name.rpartition("}")[2]
