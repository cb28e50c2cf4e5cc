"""A rig and its model as URDF: limits of torque, friction and damping of joints."""

from __future__ import annotations

from math import isfinite
from xml.etree import ElementTree

from tactile_cube.drivetrain.model_file import ModelFile
from tactile_cube.hand.urdf_tree import robot_of
from tactile_cube.identification.export.joint_drive import JointDrive, drives_of
from tactile_cube.measurement.recordings.recording import Recording

HELD = ("torque_limit", "friction", "damping")


def as_urdf(model: ModelFile, recording: Recording) -> tuple[str, list[str]]:
    """Return the recording's URDF with <dynamics> and efforts of the model, and what it does not hold, a line each."""
    drives = drives_of(model)
    left = [line for drive in drives for line in drive.not_in(HELD)]
    robot = robot_of(recording.urdf)
    by_name = {drive.name: drive for drive in drives}
    for joint in robot.findall("joint"):
        if joint.get("name") in by_name:
            _state(joint, by_name[str(joint.get("name"))])
    for line in reversed(["by tactile_cube.export", *(f"not held: {one}" for one in left)]):
        robot.insert(0, ElementTree.Comment(f" {line.replace('--', '- -')} "))
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode") + "\n", left


def _state(joint: ElementTree.Element, drive: JointDrive) -> None:
    for old in joint.findall("dynamics"):
        joint.remove(old)
    values = {"damping": f"{drive.damping:.12g}", "friction": f"{max(drive.friction, 0.0):.12g}"}
    joint.append(ElementTree.Element("dynamics", values))
    if isfinite(drive.torque_limit):
        limit = joint.find("limit")
        if limit is None:
            limit = ElementTree.SubElement(joint, "limit", {"velocity": "0"})
        limit.set("effort", f"{drive.torque_limit:.12g}")
