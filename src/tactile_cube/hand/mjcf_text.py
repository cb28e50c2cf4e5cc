"""MJCF text that names nothing outside of its folder and says only what a mechanism and its drives need."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf_tree import require_mesh
from tactile_cube.untrusted_file import below, read_text, regular

SECTIONS = ("compiler", "option", "default", "asset", "worldbody", "equality", "actuator")
ACTUATORS = ("motor", "position", "velocity", "intvelocity", "damper", "general", "dcmotor", "pid", "cylinder",
             "muscle")  # fmt: skip
PARTS = (*SECTIONS, *ACTUATORS, "mesh", "body", "frame", "joint", "freejoint", "inertial", "geom")
GENERATED = ("attach", "composite", "flexcomp", "replicate")
"""Elements that MuJoCo turns into bodies, from files or by rules."""
DRAWN = ("material", "plugin", "user")
NAMES = ("name", "class", "childclass", "joint", "joint1", "joint2", "mesh", "file")


def own_mjcf(file: Path) -> str:
    """Return an MJCF file with its includes as one text, whose meshes lie below its folder and have absolute names.

    Raises:
        InputError: no MJCF, a file elsewhere or not there, bodies that MuJoCo would generate.
    """
    try:
        return ElementTree.tostring(_own(file, file.resolve().parent), encoding="unicode")
    except RecursionError:
        raise InputError(f"{file}: its elements are nested too deeply") from None


def _own(file: Path, folder: Path) -> ElementTree.Element:
    root = _parsed(file)
    _include(root, folder, [file.resolve()])
    for part in root.iter():
        if part.tag in GENERATED:
            raise InputError(
                f"{file}: <{part.tag}> is not read; save the model from MuJoCo (MjSpec.to_xml) and take that"
            )
    _keep(root, SECTIONS)
    for part in root.iter():
        for key, value in part.items():
            if key not in NAMES and "nan" in value.lower().split():  # MuJoCo takes it for what is not said
                raise InputError(f'{file}: <{part.tag}> has {key}="{value}"; give numbers')
    compiler = {key: value for one in root.iter("compiler") for key, value in one.items()}
    if compiler.get("inertiafromgeom", "auto") != "true":
        for body in [one for one in root.iter("body") if one.find("inertial") is not None]:
            for geom in body.findall("geom"):
                body.remove(geom)
    _keep_needed_meshes(root, file, folder, compiler)
    return root


def _parsed(file: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(read_text(file).lstrip("\ufeff \r\n\t"))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{file}: not well-formed XML: {error}") from None


def _include(parent: ElementTree.Element, folder: Path, seen: list[Path]) -> None:
    """Puts what other files hold in place of each <include>; MuJoCo reads a file once too."""
    for at, child in reversed(list(enumerate(parent))):
        if child.tag != "include":
            continue
        file = below(folder, child.get("file", ""), f"{seen[0]}, <include>").resolve()
        if file in seen:
            raise InputError(f"{seen[0]}: {file.name} is included twice; include it once")
        seen.append(file)
        inner = _parsed(file)
        _include(inner, folder, seen)
        parent[at : at + 1] = list(inner)
    for child in parent:
        _include(child, folder, seen)


def _keep(root: ElementTree.Element, sections: tuple[str, ...]) -> None:
    """Leaves out what is drawn or sensed; what stays names files in meshes alone."""
    for child in list(root):
        if child.tag not in sections:
            root.remove(child)
    waiting = list(root)
    while waiting:
        part = waiting.pop()
        for key in DRAWN:
            part.attrib.pop(key, None)
        for child in list(part):
            if child.tag in PARTS and not (child.tag == "geom" and child.get("type") in ("hfield", "sdf")):
                waiting.append(child)
            else:
                part.remove(child)


def _keep_needed_meshes(root: ElementTree.Element, file: Path, folder: Path, compiler: dict[str, str]) -> None:
    needed = {geom.get("mesh") for geom in root.iter("geom")}
    place = compiler.get("meshdir") or compiler.get("assetdir") or "."
    flat = compiler.get("strippath") == "true"
    for one in root.iter("compiler"):
        for key in ("meshdir", "assetdir", "texturedir", "strippath"):
            one.attrib.pop(key, None)
    for asset, mesh in [(one, mesh) for one in root.iter("asset") for mesh in one.findall("mesh")]:
        name = mesh.get("file", "")
        if mesh.get("name", Path(name).stem) not in needed:
            asset.remove(mesh)
        elif name:
            where = f"{file}, <mesh>"
            found = below(folder / place, Path(name).name if flat else name, where, folder)
            require_mesh(regular(found, limits.MESH), where)
            mesh.set("file", str(found.resolve()))
