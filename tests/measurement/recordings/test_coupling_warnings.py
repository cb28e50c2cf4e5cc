"""What is said where a URDF and a recording name different joints to follow."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from tactile_cube.measurement.recordings.consistency import check_coupling
from tactile_cube.measurement.recordings.description import Coupling
from tactile_cube.measurement.recordings.rig import parse_rig

ENDS = '<parent link="base"/><child link="link"/>'
URDF = f"""<robot><link name="base"/><link name="link"/>
  <joint name="a" type="revolute">{ENDS}</joint>
  <joint name="b" type="revolute">{ENDS}</joint>
  <joint name="c" type="revolute">{ENDS}<mimic joint="a"/></joint>
</robot>"""


def warnings(**coupled: Coupling) -> list[str]:
    description: Any = SimpleNamespace(joints=["a", "b"], coupled=coupled)
    return check_coupling(description, parse_rig(URDF, Path("rig.urdf")))


def test_the_urdfs_own_coupling_needs_no_second_word() -> None:
    assert warnings() == []
    assert warnings(c=Coupling(joint="a")) == []


def test_another_leader_than_the_urdfs_is_warned_of() -> None:
    assert warnings(c=Coupling(joint="b")) == ["key 'coupled': the URDF lets 'c' mimic 'a', recording.yaml says b"]
