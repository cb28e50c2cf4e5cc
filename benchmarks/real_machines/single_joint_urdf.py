"""URDF of a rig with one turning joint, for data sets that bring none."""


def single_joint_urdf(
    name: str, joint: str, mass: float, length: float, inertia: float = 1e-5, axis: str = "0 1 0", limit: float = 3.2
) -> str:
    """A link of `mass` [kg] whose centre hangs `length` [m] below the joint; `inertia` [kg m^2] is about that centre.

    The arm hangs straight down at zero; with gravity along -z, a positive angle about y lifts it towards -x.
    """
    radius = 0.006
    height = max(length, 0.01)
    return f"""<?xml version="1.0"?>
<robot name="{name}">
<link name="base"/>
<link name="arm">
<inertial><origin xyz="0 0 {-length:g}"/><mass value="{mass:g}"/>
<inertia ixx="{inertia:g}" iyy="{inertia:g}" izz="{inertia:g}" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 {-height / 2:g}"/>
<geometry><cylinder radius="{radius}" length="{height:g}"/></geometry></visual>
</link>
<joint name="{joint}" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/>
<limit lower="{-limit:g}" upper="{limit:g}" effort="10" velocity="30"/></joint>
</robot>
"""
