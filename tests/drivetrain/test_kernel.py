"""Generated machine code: kept on disk, safe for several processes, renewed when a law changes."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tactile_cube.drivetrain import DrivetrainConstants, Plant
from tactile_cube.drivetrain.effects import Effect, Parameter, Stage, catalogue, find_effect, import_own_effects
from tactile_cube.drivetrain.effects.motor import TorqueBias
from tactile_cube.drivetrain.effects.transmission import Backlash, PositionOffset
from tactile_cube.drivetrain.kernel import cache_directory, load_kernel
from tactile_cube.drivetrain.signals import MOTOR_POSITION
from tactile_cube.errors import InputError
from tests.drivetrain.rigs import finger, wheel

ROOT = Path(__file__).parents[2]
LAW = """
from tactile_cube.drivetrain.effects import JOINT_TORQUE, Effect, Parameter, Stage

class Pull(Effect):
    name = "pull"
    stage = Stage.JOINT_TORQUE
    parameters = (Parameter("torque", "N m", 0.0, -1.0, 1.0, 0.1, "test"),)

    @staticmethod
    def law(x, j, p, s, dt):
        return x[JOINT_TORQUE, j] + {factor} * p[0]
"""


def test_the_same_plant_uses_the_same_module() -> None:
    plants = [Plant([wheel(inertia)], dt=dt) for inertia, dt in ((1e-3, 0.002), (2e-3, 0.001))]
    modules = {id(load_kernel(p.topology, p.effects, p.layout)) for p in plants}
    assert len(modules) == 1


def test_an_unwritable_cache_home_is_replaced_by_the_temporary_directory(tmp_path, monkeypatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    assert tmp_path in cache_directory().parents


def test_a_changed_law_gets_a_new_kernel(tmp_path, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    names = []
    for factor in (1, 2):
        (tmp_path / "my_changing_rig.py").write_text(LAW.format(factor=factor))
        importlib.invalidate_caches()
        sys.modules.pop("my_changing_rig", None)
        import_own_effects(["my_changing_rig.Pull"])
        plant = Plant([wheel()], dt=0.002, effects=[find_effect("my_changing_rig.Pull")])
        names.append(load_kernel(plant.topology, plant.effects, plant.layout).__name__)
    assert names[0] != names[1]


def test_an_effect_that_cannot_be_imported_is_refused() -> None:
    class Local(Effect):
        name = "local"
        stage = Stage.FRICTION
        parameters = (Parameter("size", "N m", 0.0, 0.0, 1.0, 0.1, "test"),)

        @staticmethod
        def law(x, j, p, s, dt):
            return 0.0

    with pytest.raises(InputError, match="file of its own"):
        _ = Plant([wheel()], dt=0.002, effects=[Local]).kernel


def numbers() -> str:
    """What a finger's control step and a wheel's steps with a gap leave in memory, as text."""
    driven = Plant([finger()], dt=0.002)
    torques = driven.memory(DrivetrainConstants())
    state = np.linspace(0.1, 0.4, 12)
    driven.kernel.control_step(0, state[:4], state[4:8], state[8:], torques)
    free = Plant([wheel()], dt=0.002, effects=(Backlash,))
    moved = free.memory(DrivetrainConstants(), effects=[Backlash("q")])
    for command in np.sin(np.linspace(0.0, 9.0, 100)):
        free.kernel.step(np.array([command]), moved)
    return str([number.hex() for number in np.concatenate([state, torques, moved])])


def test_without_compilation_the_steps_give_the_same_numbers_to_the_bit() -> None:
    program = "from tests.drivetrain.test_kernel import numbers; print(numbers(), end='')"
    interpreted = subprocess.check_output(
        [sys.executable, "-c", program], cwd=ROOT, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, text=True
    )
    assert interpreted == numbers()


def test_processes_that_start_at_once_share_one_cache(tmp_path) -> None:
    program = (
        "import numpy as np; from tactile_cube.drivetrain import DrivetrainConstants, Plant; "
        "from tests.drivetrain.rigs import wheel; p = Plant([wheel()], dt=0.002); "
        "m = p.memory(DrivetrainConstants()); p.kernel.step(np.ones(1), m); print(p.view(m, 'v')[0])"
    )
    environment = {"XDG_CACHE_HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "PYTHONPATH": f"{ROOT}:{ROOT / 'src'}"}
    jobs = [
        subprocess.Popen([sys.executable, "-c", program], env=environment, cwd=ROOT, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    outputs = [job.communicate(timeout=250)[0] for job in jobs]
    assert all(job.returncode == 0 for job in jobs)
    assert outputs[0] == outputs[1] != b""
    files = list((tmp_path / "tactile_cube").rglob("*.py"))
    assert sorted(file.name for file in files) == ["entry_points.py", "plant.py"]


SOFT = DrivetrainConstants(kp=2.0, kd=0.1, stiffness=20.0, static_friction=0.0, reflected_inertia=1e-3)
ROWS, SEGMENT, DT = 60, 20, 2e-3


def readings(effect: Effect, command: np.ndarray, starts: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Readings (60,) [rad] of a wheel's sensor in three segments."""
    plant = Plant([wheel()], dt=DT, effects=tuple(catalogue().values()))  # a kernel that most recordings need
    memory = plant.memory(SOFT, effects=[effect])[None]
    plant.reset(memory, starts[0], speeds[0])
    out = np.zeros((1, ROWS, 1, 1))
    plant.kernel.segments_batch(
        command[None, :, None], np.array([0]), np.array([ROWS]), 0, 1, SEGMENT, starts[None, :, None],
        speeds[None, :, None], np.zeros((1, 2)), np.zeros((1, 2)), memory,
        np.zeros((1, 1)), np.array([MOTOR_POSITION]), 0, 1, out,
    )  # fmt: skip
    found: np.ndarray = out[0, :, 0, 0]
    return found


def sensor(error: float) -> np.ndarray:
    """Readings of a wheel that goes to 0.1 rad by a sensor whose zero is wrong, less that error."""
    starts = error + 0.02 * np.arange(3)  # all that a user knows of a start is what the sensor said
    return readings(PositionOffset("q", offset=error), np.full(ROWS, 0.1 + error), starts, np.zeros(3)) - error


@pytest.mark.parametrize("error", [0.1, -0.3])
def test_a_wrong_zero_of_the_sensor_moves_no_start(error: float) -> None:
    assert sensor(error) == pytest.approx(sensor(0.0), abs=5e-5)


def test_a_joint_stands_where_an_added_torque_and_its_controller_balance_from_the_first_step_on() -> None:
    rest = 0.2 / SOFT.kp
    seen = readings(TorqueBias("q", bias=0.2), np.zeros(ROWS), np.full(3, rest), np.zeros(3))
    assert seen == pytest.approx(np.full(ROWS, rest), abs=1e-5)


def test_a_joint_that_its_sensor_does_not_show_goes_on_through_the_start_of_a_segment() -> None:
    """A wheel rolls freely while its motor runs along in the gap; every later measured speed says that it stands."""
    motor = 0.5 * DT * np.arange(ROWS)
    starts = motor[::SEGMENT].copy()  # side by side, as the kernel that is there already takes them
    seen = readings(Backlash("q", gap=0.02), motor + 0.1 / 2.0 * 0.5, starts, np.array([0.5, 0.0, 0.0]))
    assert seen == pytest.approx(motor, abs=1e-9)
