"""Units of columns against the SI's."""

from collections.abc import Callable

import numpy as np
import pytest

from tactile_cube.measurement.recordings.rig import RigJoint
from tactile_cube.measurement.sources.units import Unit, position_unit, time_unit, torque_unit

NUMBERS = np.arange(3.0)


@pytest.mark.parametrize(
    ("said", "sizes"),
    [
        (lambda unit: time_unit(unit, "", NUMBERS), {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}),
        (
            lambda unit: position_unit(unit, "", NUMBERS, RigJoint("a", -0.5, 0.5, None)),
            {"rad": 1.0, "deg": 0.0174532925, "turn": 6.28318531, "mrad": 1e-3},
        ),
        (
            lambda unit: position_unit(unit, "", NUMBERS, RigJoint("a", -0.5, 0.5, None, prismatic=True)),
            {"m": 1.0, "mm": 1e-3, "um": 1e-6},
        ),
        (lambda unit: torque_unit(unit, "", prismatic=False), {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2}),
        (lambda unit: torque_unit(unit, "", prismatic=True), {"N": 1.0, "mN": 1e-3, "kN": 1e3}),
    ],
)
def test_units_that_are_said_have_their_size_in_the_si(said: Callable[[str], Unit], sizes: dict[str, float]) -> None:
    assert {unit: said(unit).size for unit in sizes} == pytest.approx(sizes, rel=1e-8)
