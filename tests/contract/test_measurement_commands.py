"""The command lines record and compare as a user types them."""

import json
from pathlib import Path

import numpy as np
import polars
import pytest

from tactile_cube.drivetrain.model_file import read_model
from tests.measurement.small_rig import URDF, table, write
from tests.typed import typed


def made_rig(folder: Path, *settings: str) -> tuple[str, ...]:
    """Words of `record` for a rig with two joints, whose URDF is written into the folder."""
    (folder / "two.urdf").write_text(URDF)
    return ("out=made", "source=rig", "source.urdf=two.urdf", "source.initialisations=2", *settings)


def test_record_then_compare(tmp_path: Path) -> None:
    words = made_rig(tmp_path, "source.duration=2", "source.step=0.002")
    made = typed("record", *words, folder=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "8 trials" in made.stdout
    again = typed("record", *words, folder=tmp_path)
    assert again.returncode == 2
    assert "holds a recording already" in again.stderr

    compared = typed("compare", "recording=made", "band.simulations=3", "hydra.run.dir=run", folder=tmp_path)
    assert compared.returncode == 0, compared.stderr
    assert json.loads((tmp_path / "run" / "comparison.json").read_text())["error"]["overall"] > 0
    assert {"report.html", "comparison.rrd"} <= {path.name for path in (tmp_path / "run").iterdir()}


def test_a_csv_import_that_failed_does_not_block_the_corrected_command(tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(URDF)
    for number in range(2):
        columns = {name.replace(".", "_"): values for name, values in table(number).items()}
        polars.DataFrame(columns | {"time": 1000 * columns["time"]}).write_csv(tmp_path / f"sines_{number}.csv")
    nothing = typed("record", "source=csv", "out=rec", folder=tmp_path)
    assert nothing.returncode == 2
    assert "source.files=... (" in nothing.stderr
    assert "source.urdf=FILE or source.robot=NAME" in nothing.stderr
    words = ["source=csv", "out=rec", "source.files=[sines_*.csv]", "source.urdf=two.urdf"]
    words += ["source.controller.kp=3", "source.controller.kd=0.2", "source.nominal.static_friction=0.01"]
    wrong = typed("record", *words, "source.time_unit=s", folder=tmp_path)
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("error: sines_0.csv: column 'time', row 1: steps of 10 s")
    assert "source.time_unit=ms" in wrong.stderr
    right = typed("record", *words, folder=tmp_path)
    assert right.returncode == 0, right.stderr
    assert "time time [ms], 100 Hz" in " ".join(right.stdout.split())
    assert "rec: 2 trials (sines), 6 s, joints a, b" in right.stdout
    assert {path.name for path in tmp_path.iterdir()} >= {"rec", "outputs"}
    assert not list(tmp_path.glob(".rec*"))


ARM = """<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="0.4"/>
<inertia ixx="1e-4" iyy="1.6e-2" izz="1.6e-2" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="shoulder_pan"
type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="5"
velocity="9"/></joint></robot>"""
KP, KD, INERTIA, DELAY, LIMIT, FPS = 6.0, 0.6, 0.02, 0.06, 3.0, 30


def lerobot_set(folder: Path, delay: float = 0.0, limit: float = np.inf) -> None:
    """Episodes that are cut out of a motion, of J dv = KP (g(t - delay) - q) - KD v; position is read, then sent.

    g follows the goal by up to `limit` [rad/s].
    """
    rng, steps = np.random.default_rng(0), 100
    rows = []
    for episode in range(4):
        corners = np.cumsum(np.concatenate([[0.0], rng.uniform(0.2, 0.7, 40)]))
        command = np.interp(np.arange(8 * FPS) / FPS, corners, rng.uniform(-1.0, 1.0, 41))
        held = np.concatenate([np.full(round(delay * FPS * steps), command[0]), np.repeat(command, steps)])
        q, g, v, position, most = command[0], command[0], 0.0, np.zeros(len(command)), limit / FPS / steps
        for k in range(len(command) * steps):
            position[k // steps] = q if k % steps == 0 else position[k // steps]
            g += max(-most, min(most, held[k] - g))
            v += (KP * (g - q) - KD * v) / INERTIA / FPS / steps
            q += v / FPS / steps
        read = np.round(position * 4096 / (2 * np.pi)) * 360 / 4096
        for k in range(2 * FPS, len(command)):
            degrees = [np.rad2deg(command[k])], [read[k]]
            rows.append((*degrees, k / FPS - 2, episode))
    names = ["action", "observation.state", "timestamp", "episode_index"]
    (folder / "data/chunk-000").mkdir(parents=True)
    (folder / "meta").mkdir()
    features = {name: {"names": ["shoulder_pan.pos"]} for name in names[:2]}
    (folder / "meta/info.json").write_text(json.dumps({"fps": FPS, "features": features}))
    polars.DataFrame(rows, schema=names, orient="row").write_parquet(folder / "data/chunk-000/file-000.parquet")


@pytest.mark.parametrize(
    ("hidden", "named", "within"), [({"delay": DELAY}, "command_delay", 0.002), ({"limit": LIMIT}, "rate_limit", 0.02)]
)
def test_from_a_lerobot_data_set_to_a_named_effect_by_one_command(hidden, named, within, tmp_path) -> None:
    lerobot_set(tmp_path / "set", **hidden)
    (tmp_path / "arm.urdf").write_text(ARM)
    words = ["source=csv", "source.files=set", "source.urdf=arm.urdf", "source.angle_unit=deg", "hydra.run.dir=run"]
    words += ["report=false"]
    words += [f"source.controller.kp={KP}", f"source.controller.kd={KD}"]
    asked = typed("diagnose", *words, folder=tmp_path)
    assert asked.returncode == 0, asked.stderr
    assert "one where 'episode_index' changes" in asked.stdout
    assert "of 4 trials; their first 0.4 s count in no error" in asked.stdout
    (effect,) = read_model(tmp_path / "run" / "model.yaml").effects
    assert effect.effect == f"{named}@shoulder_pan"
    (found,) = effect.parameters.values()
    assert found.value == pytest.approx(*hidden.values(), abs=within)
    assert read_model(tmp_path / "run" / "model.yaml").provenance.recording.endswith("run/recording")


def test_what_is_known_already_is_no_news_to_diagnose(tmp_path: Path) -> None:
    settings = ["source.joints=[b]", "source.duration=3", "source.kinds=[ramps,multisine]"]
    settings += ['source.hidden=["torque_bias@b: bias=0.05"]']
    made = typed("record", *made_rig(tmp_path, *settings), folder=tmp_path)
    assert made.returncode == 0, made.stderr
    words = ["recording=made"]
    fitted = typed("identify", *words, "effects=[torque_bias@b]", "hydra.run.dir=known", folder=tmp_path)
    assert fitted.returncode == 0, fitted.stderr
    words += ["hydra.run.dir=run", "report=false"]
    asked = typed("diagnose", *words, "model=known/model.yaml", folder=tmp_path)
    assert asked.returncode == 0, asked.stderr
    result = json.loads((tmp_path / "run" / "diagnosis.json").read_text())
    assert (result["verdict"], result["effects"]) == ("adequate", [])
    assert result["known_effects"] == ["torque_bias@b"]
    assert result["error"]["nominal"] < 2 * result["error"]["noise_floor"], "the error of the model that was given"
    assert "beside what was known: torque_bias@b" in asked.stdout
    (effect,) = read_model(tmp_path / "run" / "model.yaml").effects
    assert effect.effect == "torque_bias@b"
    assert effect.parameters["bias"].low <= 0.05 <= effect.parameters["bias"].high

    (tmp_path / "other.yaml").write_text("joints: [x]\n")
    refused = typed("diagnose", *words, "model=other.yaml", folder=tmp_path)
    assert refused.returncode == 2
    assert "model: joints ['x'] are not those of the recording" in refused.stderr


def test_a_grasp_is_compared_too(tmp_path: Path) -> None:
    settings = ["source=grasp", "source.kinds=[twist]", "source.levers=[0.06]", "source.initialisations=1"]
    made = typed("record", "out=grip", *settings, "source.validation=false", folder=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "next: python -m tactile_cube.compare recording=grip" in made.stdout
    compared = typed("compare", "recording=grip", "hydra.run.dir=run", folder=tmp_path)
    assert compared.returncode == 0, compared.stderr
    assert "twist_0_0 simulated, 1 of 1" in compared.stderr
    assert "the error of a grasp with all true contact effects" in (tmp_path / "run" / "report.html").read_text()


def test_a_bad_recording_is_one_line_and_status_2(tmp_path: Path) -> None:
    write(tmp_path / "r", spoil=lambda columns: columns.pop("a.command"))
    result = typed("compare", "recording=r", folder=tmp_path)
    assert result.returncode == 2
    assert result.stderr.strip().splitlines()[-1].startswith("error: r/first.parquet: column 'a.command' is missing")
