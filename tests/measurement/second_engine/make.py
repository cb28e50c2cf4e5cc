"""Writes `finger/`: one finger of the hand moved by MuJoCo, free of sensor noise, with the true constants stated.

The drive is written out here and the links are MuJoCo's: nothing of the package moves this finger.
`PYTHONPATH=src python tests/measurement/second_engine/make.py`
"""

from pathlib import Path

import mujoco
import numpy as np

from tactile_cube.hand import DLR_HAND2
from tactile_cube.measurement.recordings.description import TrialEntry
from tactile_cube.measurement.recordings.writing import RecordingTables, TrialTable, write_recording
from tactile_cube.measurement.sources.source import described

FOLDER = Path(__file__).parent / "finger"
JOINTS = ("q1", "q2", "q3")
KP, KD, STIFFNESS = 3.69, 0.25, 25.0  # [N m/rad, N m s/rad, N m/rad]
FRICTION, INERTIA, LIMIT = 0.02, 0.003, 1.0  # [N m, kg m^2, N m]
GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2]
RATE, STEP, SECONDS, SETTLING = 250, 1e-4, 3.0, 1.0  # [Hz, s, s, s]
CENTRE, REACH = np.array([0.0, 0.5, 0.6]), np.array([0.25, 0.4, 0.5])  # [rad]


def finger() -> mujoco.MjModel:
    """The links of the URDF; q4 follows q3, rotors are armatures, dry friction is as stiff as the step allows."""
    header = '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco>'
    urdf = DLR_HAND2.finger_urdf(0)
    end = urdf.index(">", urdf.index("<robot")) + 1
    spec = mujoco.MjSpec.from_string(urdf[:end] + header + urdf[end:])
    coupling = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
    coupling.name1, coupling.name2 = "q4", "q3"
    coupling.data[:5] = (0.0, 1.0, 0.0, 0.0, 0.0)
    coupling.solref[:] = (5e-4, 1.0)
    model = spec.compile()
    model.opt.timestep, model.opt.gravity[:] = STEP, GRAVITY
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    for name in JOINTS:
        dof = model.joint(name).dofadr[0]
        model.dof_armature[dof], model.dof_frictionloss[dof] = INERTIA, FRICTION
        model.dof_solref[dof], model.dof_solimp[dof, :3] = (5e-4, 1.0), (0.99, 0.99, 0.001)
    return model


def commands(kind: str) -> np.ndarray:
    """Desired angles (samples, 3) [rad]: sines of several frequencies, or slow ramps that reverse and rest."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    if kind == "multisine":
        rates = np.array([[0.5, 1.3, 2.9], [0.4, 1.1, 2.3], [0.6, 1.7, 3.1]])  # [Hz]
        waves = np.sin(2.0 * np.pi * rates[:, :, None] * time) * np.array([0.6, 0.3, 0.1])[:, None]
        return CENTRE + REACH * (np.minimum(2.0 * time, 1.0) * waves.sum(axis=1)).T  # from rest
    periods = np.array([1.0, 1.5, 3.0])  # [s]
    triangle = 2.0 * np.abs(2.0 * (time[:, None] / periods % 1.0) - 1.0) - 1.0
    return CENTRE - REACH * np.clip(1.3 * triangle, -1.0, 1.0)


def drive(data: mujoco.MjData, dofs: list[int], command: np.ndarray) -> np.ndarray:
    """tau = K_P (q_d - q_m) - K_D dq (3,) [N m] with q_m = q + tau / K_e."""
    free = (KP * (command - data.qpos[dofs]) - KD * data.qvel[dofs]) / (1.0 + KP / STIFFNESS)
    return np.clip(free, -LIMIT, LIMIT)


def move(model: mujoco.MjModel, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motor positions [rad] and torques [N m] (samples, 3), settled at the first command before."""
    data, dofs = mujoco.MjData(model), [model.joint(name).dofadr[0] for name in JOINTS]
    follower = model.joint("q4").qposadr[0]
    data.qpos[dofs], data.qpos[follower] = command[0], command[0, 2]
    position, torques, per = np.empty_like(command), np.empty_like(command), round(1.0 / (RATE * STEP))
    for k in range(-round(SETTLING / STEP), len(command) * per):
        row = max(k, 0) // per
        torque = drive(data, dofs, command[row])
        data.qfrc_applied[dofs] = torque
        mujoco.mj_step(model, data)
        if k >= 0 and (k + 1) % per == 0:  # a row holds a command and what it has led to one sample later
            torques[row] = drive(data, dofs, command[row])
            position[row] = data.qpos[dofs] + torques[row] / STIFFNESS
    return position, torques


def main() -> None:
    """Write the recording."""
    model, tables = finger(), []
    for kind in ("multisine", "ramps"):
        command = np.round(commands(kind), 6)
        position, torque = move(model, command)
        time = np.arange(len(command)) / RATE
        entry = TrialEntry(file=f"{kind}.parquet", initialisation=0, kind=kind)
        tables.append(TrialTable(entry, time, command, position.round(6), torque.round(6)))
    description = described(
        gravity=list(GRAVITY), rate_hz=RATE, joints=list(JOINTS), coupled={"q4": {"joint": "q3"}},
        controller={"kp": KP, "kd": KD, "torque_limit": LIMIT},
        nominal={"stiffness": STIFFNESS, "static_friction": FRICTION, "reflected_inertia": INERTIA},
        sensors={"position_resolution": 1e-6},
    )  # fmt: skip
    write_recording(FOLDER, RecordingTables(description, DLR_HAND2.finger_urdf(0), tables))


if __name__ == "__main__":
    main()
