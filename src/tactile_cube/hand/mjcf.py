"""An MJCF file, freed of all that names other files, read by MuJoCo as a URDF and the constants of its drives."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_cube import limits
from tactile_cube.errors import InputError
from tactile_cube.hand.urdf import Array, inertial_element, number_list, origin_element, robot_element
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
    """Put what other files hold in place of each <include>; MuJoCo reads a file once too."""
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
    """Leave out what is drawn or sensed; what stays names files in meshes alone."""
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


OF_JOINTS = {"armature": "reflected_inertia", "frictionloss": "static_friction", "damping": "viscous_friction"}
"""MuJoCo's constants of a joint, and what recording.yaml calls them."""
GAINS = ("kp", "kd")
USUAL_GRAVITY = (0.0, 0.0, -9.81)  # that importers take where none is said [m/s^2]


@dataclass(frozen=True)
class Mjcf:
    """Mechanism of an MJCF file, and what the file states of drives.

    Attributes:
        urdf: the mechanism as a URDF.
        stated: constant -> joint -> value: reflected_inertia [kg m^2], static_friction [N m], viscous_friction
            [N m s/rad]; of joints with one actuator kp [N m/rad], kd [N m s/rad] and torque_limit [N m].
        left_out: what the file says and a recording's model has no place for, a line each.
    """

    urdf: str
    stated: dict[str, dict[str, float]] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()


def is_mjcf(text: str) -> bool:
    """Return whether a text may be MJCF: its first element is <mujoco>."""
    start = text.find("<mujoco")
    return start >= 0 and "<robot" not in text[:start]


def read_mjcf(file: Path) -> Mjcf:
    """Read a mechanism and its drives; joints at zero are where MuJoCo's qpos is zero.

    Raises:
        InputError: MuJoCo cannot read it, or it names files elsewhere.
    """
    import mujoco  # takes 0.1 s

    text = own_mjcf(file)
    try:
        model = mujoco.MjSpec.from_string(text).compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = "; ".join(line for line in str(error).split("\n") if line)
        raise InputError(f"{file}: MuJoCo does not read it: {reason}") from None
    if model.njnt > limits.JOINTS:
        raise InputError(f"{file}: it has {model.njnt} joints; at most {limits.JOINTS} are read")
    return _Reader(model, mujoco).read(file.stem)


class _Reader:
    def __init__(self, model: Any, mujoco: Any) -> None:
        self.model, self.mujoco = model, mujoco
        self.bodies = [model.body(k).name or f"body_{k}" for k in range(model.nbody)]
        self.joints = [model.joint(k).name or f"joint_{k}" for k in range(model.njnt)]
        self.stated: dict[str, dict[str, float]] = {}
        self.left_out: list[str] = []

    def read(self, name: str) -> Mjcf:
        mimics = dict(self._mimics())
        parts = [_link(self.bodies[0])]
        for body in range(1, self.model.nbody):
            parts += self._body(body, mimics)
        gravity = self.model.opt.gravity
        if not np.allclose(gravity, USUAL_GRAVITY, atol=0.01):
            self.left_out.append(f"gravity of {number_list(gravity)} m/s^2; state it in source.gravity")
        for joint in range(self.model.njnt):
            if self._kind(joint) in ("HINGE", "SLIDE"):
                self._joint_constants(joint)
        for actuator in range(self.model.nu):
            self._actuator(actuator)
        limits_of = self.stated.get("torque_limit", {})
        self.stated["torque_limit"] = {joint: limits_of.get(joint, np.inf) for joint in self.joints}
        stated = {key: row for key, row in self.stated.items() if key in GAINS or set(row.values()) - {0.0, np.inf}}
        return Mjcf(robot_element(escape(name), parts), stated, tuple(self.left_out))

    def _body(self, body: int, mimics: dict[int, str]) -> list[str]:
        """Return the links and joints of a body: one link for each joint, of which the last one is the body's."""
        m, name = self.model, self.bodies[body]
        parent, first = m.body_parentid[body], m.body_jntadr[body]
        place, turn = m.body_pos[body] - self._shift(parent), _matrix(m.body_quat[body])
        joints = list(range(first, first + m.body_jntnum[body]))
        links = [*(f"{name}_{self.joints[j]}" for j in joints[:-1]), name]
        before, parts = self.bodies[parent], []
        if not joints:
            parts.append(_joint_element(f"{name}_fixed", "fixed", before, name, origin_element(place, turn)))
        for joint, link in zip(joints, links, strict=False):
            at = self._place(joint)
            parts.append(self._joint(joint, before, link, place + turn @ at, turn, mimics))
            place, turn, before = -at, np.eye(3), link
        inertia = _matrix(m.body_iquat[body]) @ np.diag(m.body_inertia[body]) @ _matrix(m.body_iquat[body]).T
        mass = inertial_element(m.body_mass[body], m.body_ipos[body] - self._shift(body), inertia, digits=15)
        return [*parts, *map(_link, links[:-1]), _link(name, mass)]

    def _shift(self, body: int) -> Array:
        """Return the origin of a body's link in the body's frame: its last joint."""
        count = self.model.body_jntnum[body]
        return self._place(self.model.body_jntadr[body] + count - 1) if count else np.zeros(3)

    def _place(self, joint: int) -> Array:
        """Return the position of a joint in its body's frame (3,) [m]; zero for a free joint."""
        return np.zeros(3) if self._kind(joint) == "FREE" else np.asarray(self.model.jnt_pos[joint])

    def _joint(self, joint: int, parent: str, child: str, place: Array, turn: Array, mimics: dict[int, str]) -> str:
        m, name, kind = self.model, self.joints[joint], self._kind(joint)
        if kind not in ("HINGE", "SLIDE"):
            return _joint_element(name, "floating", parent, child, origin_element(place, turn))
        axis, zero = m.jnt_axis[joint], m.qpos0[m.jnt_qposadr[joint]]
        if kind == "SLIDE":
            place = place - turn @ axis * zero
        else:
            turn = turn @ Rotation.from_rotvec(-zero * axis).as_matrix()
        limited, (lower, upper) = bool(m.jnt_limited[joint]), m.jnt_range[joint]
        ends = f'<limit lower="{lower:.15g}" upper="{upper:.15g}" effort="0" velocity="0"/>' if limited else ""
        more = f'<axis xyz="{number_list(axis)}"/>{ends}{mimics.get(joint, "")}'
        turning = "revolute" if limited else "continuous"
        named = "prismatic" if kind == "SLIDE" else turning
        return _joint_element(name, named, parent, child, origin_element(place, turn) + more)

    def _kind(self, joint: int) -> str:
        return self._named("mjtJoint", self.model.jnt_type[joint])

    def _named(self, kind: str, number: int) -> str:
        """Return MuJoCo's word for a number of an enumeration, without prefix."""
        return str(getattr(self.mujoco, kind)(int(number)).name).partition("_")[2]

    def _mimics(self) -> Iterator[tuple[int, str]]:
        m = self.model
        for k in range(m.neq):
            name, (a0, a1, *more) = m.eq(k).name or f"equality {k}", m.eq_data[k][:5]
            pair = self._named("mjtEq", m.eq_type[k]) == "JOINT" and m.eq_obj2id[k] >= 0 and m.eq_active0[k]
            if not pair or any(more):
                self.left_out.append(
                    f"equality '{name}': only a joint that follows another one in proportion is simulated"
                )
                continue
            follower, leader = m.eq_obj1id[k], m.eq_obj2id[k]
            zero = m.qpos0[m.jnt_qposadr[[follower, leader]]]
            offset = zero[0] + a0 - a1 * zero[1]
            leading = escape(self.joints[leader])
            yield follower, f'<mimic joint="{leading}" multiplier="{a1:.15g}" offset="{offset:.15g}"/>'

    def _joint_constants(self, joint: int) -> None:
        m, name = self.model, self.joints[joint]
        for theirs, ours in OF_JOINTS.items():
            self.stated.setdefault(ours, {})[name] = float(getattr(m, f"dof_{theirs}")[m.jnt_dofadr[joint]])
        if m.jnt_stiffness[joint]:
            self.left_out.append(f"joint '{name}': the spring of {m.jnt_stiffness[joint]:g} N m/rad")

    def _actuator(self, k: int) -> None:
        """Return gains and limits of a motor or a position actuator; MuJoCo's forces act on a joint times the gear."""
        m, name = self.model, self.model.actuator(k).name or f"number {k}"
        joint, gear = self.joints[m.actuator_trnid[k, 0]], m.actuator_gear[k, 0]
        if self._named("mjtTrn", m.actuator_trntype[k]) not in ("JOINT", "JOINTINPARENT"):
            self.left_out.append(f"actuator '{name}': it drives no joint directly")
            return
        if joint in self.stated.get("torque_limit", {}):
            self.left_out.append(f"actuator '{name}': joint '{joint}' has another one")
            return
        for theirs, ours in (("armature", "reflected_inertia"), ("damping", "viscous_friction")):
            self.stated.setdefault(ours, {}).setdefault(joint, 0.0)
            self.stated[ours][joint] += float(gear**2 * getattr(m, f"actuator_{theirs}")[k])
        most = max(abs(m.actuator_forcerange[k])) * abs(gear) if m.actuator_forcelimited[k] else np.inf
        self.stated.setdefault("torque_limit", {})[joint] = float(most)
        gain, bias = m.actuator_gainprm[k], m.actuator_biasprm[k]
        law = self._named("mjtGain", m.actuator_gaintype[k]), self._named("mjtBias", m.actuator_biastype[k])
        if law == ("FIXED", "AFFINE") and bias[1] == -gain[0] and bias[0] == 0.0:
            self.stated.setdefault("kp", {})[joint] = float(gear**2 * gain[0])
            self.stated.setdefault("kd", {})[joint] = float(gear**2 * -bias[2])
        elif law != ("FIXED", "NONE"):
            self.left_out.append(f"actuator '{name}': it is neither a motor nor a position actuator")
        if self._named("mjtDyn", m.actuator_dyntype[k]) != "NONE":
            self.left_out.append(f"actuator '{name}': its activation dynamics")
        if m.actuator_delay[k]:
            self.left_out.append(f"actuator '{name}': its delay of {m.actuator_delay[k]:g} s")
        if gear != 1.0:
            self.left_out.append(f"actuator '{name}': its gear of {gear:g}; commands are taken as the joint's")


def _link(name: str, inside: str = "") -> str:
    return f'<link name="{escape(name)}">{inside}</link>'


def _joint_element(name: str, kind: str, parent: str, child: str, inside: str) -> str:
    ends = f'<parent link="{escape(parent)}"/><child link="{escape(child)}"/>'
    return f'<joint name="{escape(name)}" type="{kind}">{ends}{inside}</joint>'


def _matrix(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion in MuJoCo's order, w first."""
    return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).as_matrix())
