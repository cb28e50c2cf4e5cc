"""The pages and recordings that compare, diagnose and identify write."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_cube.drivetrain.model_file import EffectEstimate, Estimate, ModelFile
from tactile_cube.identification.next_experiment import Experiment
from tactile_cube.identification.search.residual_shape import Shape
from tactile_cube.measurement.comparing.comparison import Comparison, compare_recording, describe_comparison
from tactile_cube.measurement.comparing.error import ErrorSummary
from tactile_cube.measurement.comparing.noise_floor import noise_floor
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.measurement.replay.simulator import Simulated
from tactile_cube.measurement.units import of_joint
from tactile_cube.visualization.charts import MEASURED, band, overlay
from tactile_cube.visualization.comparison_report import comparison_report, summary
from tactile_cube.visualization.diagnosis_report import diagnosis_report, identification_report
from tactile_cube.visualization.report import Report, Section, Table, write_report
from tests.identification.easy_safety import half_used
from tests.measurement.small_rig import URDF, write

VOID = {"meta", "br", "line", "rect", "circle", "path", "input", "link"}


class Balanced(HTMLParser):
    """Collects the text and checks that every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    recording = read_recording(write(tmp_path_factory.mktemp("recording")))
    delay = EffectEstimate(
        effect="command_delay@a", parameters={"delay": Estimate(value=0.02, low=0.015, high=0.025, unit="s")}
    )
    kd = {"a": Estimate(value=0.22, low=0.2, high=0.24, unit="N m s/rad")}
    model = ModelFile(joints=["a", "b"], values={"kd": kd}, effects=[delay])
    return compare_recording(recording, model, simulations=4, spread={"kd": 0.2})


def page(report: Report, path: Path) -> str:
    write_report(report, path)
    text = path.read_text()
    assert len(text) < 5_000_000
    assert not re.search(r'(?:src|href)="(?!#)', text), "needs another file"
    reader = Balanced()
    reader.feed(text)
    assert reader.open == []
    return re.sub(r"\s+", " ", reader.text)


def diagnosed(diagnosis: dict[str, Any], comparison: Comparison, folder: Path, *more: Any, **named: Any) -> str:
    """The page of a diagnosis that recommends the model that it began with."""
    return page(diagnosis_report(diagnosis, comparison, comparison, "cmd", "m.yaml", *more, **named), folder / "d.html")


def test_what_was_interpolated_over_dropped_samples_is_not_drawn_as_measured(comparison: Comparison) -> None:
    trial = comparison.recording.trials[0]
    valid = np.ones(len(trial.time), dtype=bool)
    valid[20:40] = False
    trials = (replace(trial, valid=valid), *comparison.recording.trials[1:])
    dropped = replace(comparison, recording=replace(comparison.recording, trials=trials))
    for figure in (overlay, band):
        whole, broken = (_curve(figure(one, 0, 0), MEASURED) for one in (comparison, dropped))
        assert (whole.count("M"), broken.count("M")) == (1, 2)


def _curve(svg: str, color: str) -> str:
    """What is drawn in a colour."""
    return max(re.findall(rf' d="([^"]+)"[^>]*stroke: {color}', svg), key=len)


def test_the_comparison_page_says_what_how_well_where_and_what_next(comparison: Comparison, tmp_path: Path) -> None:
    text = page(comparison_report(comparison, "python -m tactile_cube.compare", "model.yaml"), tmp_path / "report.html")
    for heading in ("What was compared", "How well", "Where it fails", "Measured and simulated", "What to do next"):
        assert heading in text
    assert "command_delay@a" in text
    assert "tactile_cube.diagnose recording=" in text
    assert all(sentence in text for sentence in comparison.sentences)


def test_after_a_complete_success_what_is_left_is_called_noise(comparison: Comparison, tmp_path: Path) -> None:
    alike = replace(
        comparison,
        errors=ErrorSummary(comparison.floor.overall, dict(comparison.floor.joints)),
        whiteness=[replace(one, p_value=1e-9) for one in comparison.whiteness],
    )
    text = page(comparison_report(alike, "cmd", None), tmp_path / "report.html")
    section = text[text.index("Yes, as far as this recording can tell") :]
    assert "< 0.001" not in section
    worse = page(comparison_report(comparison, "cmd", None), tmp_path / "worse.html")
    assert "Not at a" in worse
    assert "by chance (p)" in worse


def test_compare_and_diagnose_state_one_floor(comparison: Comparison) -> None:
    assert comparison.floor.step_size, "compare looks at the time step too"
    assert comparison.floor.overall == noise_floor(comparison.recording).overall
    lines = summary(comparison).splitlines()
    assert {"a", "b", "all"} <= {line.split()[0] for line in lines if line}
    assert "noise floor: scatter of 2 repeats" in lines
    assert any(line.startswith("beside it: sensor noise 0.") for line in lines)
    assert any(line.startswith("beside it: the simulator's own time step") for line in lines)


def test_a_sliding_joint_is_shown_in_millimetres_and_newtons(tmp_path: Path) -> None:
    urdf = URDF.replace('name="a" type="revolute"', 'name="a" type="prismatic"')
    recording = read_recording(write(tmp_path / "r", urdf=urdf))
    assert recording.units == {"a": "m", "b": "rad"}
    kd = {joint: Estimate(value=0.2, low=0.1, high=0.3, unit="N m s/rad") for joint in "ab"}
    friction = EffectEstimate(
        effect="coulomb_friction@a", parameters={"friction": Estimate(value=0.1, low=0.05, high=0.2, unit="N m")}
    )
    model = ModelFile(joints=["a", "b"], values={"kd": kd}, effects=[friction])
    runs = [Simulated(trial.command, np.zeros_like(trial.command)) for trial in recording.trials]
    one = describe_comparison(recording, model, runs, noise_floor(recording), None, 0.002)
    text = page(identification_report(one, DIAGNOSIS["error"], {}, "cmd", "m.yaml"), tmp_path / "i.html")
    assert "kd a0.20.1 .. 0.30.2N s/m" in text
    assert "kd b0.20.1 .. 0.30.2N m s/rad" in text
    assert "0.1 N [0.05, 0.2]" in text
    assert "a [mm]" in text
    assert "b [mrad]" in text
    assert "mrad or mm" in summary(one)
    assert [" mm" in line for line in sorted(one.sentences)] == [True, False]


def test_a_log_in_degrees_is_shown_in_degrees_everywhere(comparison: Comparison, tmp_path: Path) -> None:
    recording, errors = comparison.recording, {"nominal": {"a": 0.007, "b": 0.006}}
    described = recording.description.model_copy(update={"shown_in": {"a": "deg", "b": "deg"}})
    in_degrees = replace(recording, description=described)
    one = compare_recording(in_degrees, comparison.model, floor=comparison.floor)
    degrees = f"{np.degrees(one.errors.overall):.3g} deg (RMS) away"
    unknown = DIAGNOSIS | {"verdict": "unknown_effect", "units": recording.units, "error_joints": errors}
    signal = {"depends_most_on": "position of b [rad]", "beside": "the refitted model"}
    unknown["unexplained"] = [{"joint": "b", "black_box": 0.93, **signal}]
    x = np.linspace(-1, 1, 12)
    shape = Shape("b", "position of b [rad]", x, 0.01 * x, np.full(12, 0.002), 0.83)
    pages = [
        comparison_report(one, "cmd", None),
        diagnosis_report(unknown, one, one, "cmd", "m.yaml", [shape]),
        identification_report(one, DIAGNOSIS["error"], errors, "cmd", "m.yaml"),
    ]
    said = [page(made, tmp_path / "r.html") for made in pages]
    assert degrees in said[0]
    assert degrees in summary(one)
    assert "position of b [deg]" in said[1]
    assert "fell from 0.401 deg to 0.0344 deg" in said[2]
    assert [text for text in (*said, summary(one)) if "mrad" in text or "[rad]" in text] == []


@pytest.mark.parametrize(
    ("turning", "sliding"),
    [("N m s/rad", "N s/m"), ("N m/rad^3", "N/m^3"), ("kg m^2", "kg"), ("rad/s per N m", "m/s per N"), ("s", "s"),
     ("position of b [rad]", "position of b [m]"), ("torque of gradient [N m]", "torque of gradient [N]")],
)  # fmt: skip
def test_units_of_a_sliding_joint(turning: str, sliding: str) -> None:
    assert of_joint(turning, "m") == sliding
    assert of_joint(turning, "rad") == turning


DIAGNOSIS: dict[str, Any] = {
    "verdict": "missing_effect",
    "effects": [
        {
            "name": "command_delay",
            "joints": ["a"],
            "parameters": {"delay": {"value": 0.02, "low": 0.015, "high": 0.025, "unit": "s"}},
            "heldout_gain": 0.8,
            "p_value": 1e-5,
            "rivals": ["actuator_lag"],
        }
    ],
    "unexplained": [],
    "unexplained_joints": [],
    "ranking": [{"effects": "command_delay@a", "gain": 0.8}, {"effects": "backlash@a", "gain": 0.1}],
    "error": {"nominal": 0.007, "refitted": 0.005, "with_effects": 0.0006, "noise_floor": 0.0005},
    "next_experiment": None,
    "seconds": 12.0,
}


def test_the_diagnosis_page_names_the_effect_its_interval_and_its_rivals_and_draws_traces_before_and_after(
    comparison: Comparison, tmp_path: Path
) -> None:
    before = compare_recording(comparison.recording, floor=comparison.floor)
    text = page(diagnosis_report(DIAGNOSIS, before, comparison, "cmd", "model.yaml"), tmp_path / "d.html")
    for name in ("before and after", "simulated before", "simulated after", "error before", "error after"):
        assert name in text
    assert "An effect is missing, and it is this one: command_delay at a: delay 0.02 [0.015, 0.025] s" in text
    assert "0.02 s [0.015, 0.025]" in text
    assert "cannot be told from actuator_lag" in text
    assert "effects=[command_delay@a]" in text


def test_a_diagnosis_with_an_object_shows_its_error_and_what_identify_takes(comparison, tmp_path) -> None:
    slipping = DIAGNOSIS["effects"][0] | {"name": "lateral_friction", "joints": ["object"]}
    contact = {"error": {"nominal": 0.009, "refitted": 0.009, "with_effects": 0.003}, "error_joints": {}}
    both = DIAGNOSIS | {"effects": [*DIAGNOSIS["effects"], slipping], "contact": contact}
    text = diagnosed(both, comparison, tmp_path)
    assert "How the error with an object falls" in text
    assert "9 mrad" in text
    assert "effects=[command_delay@a,lateral_friction]" in text


WAVE = np.sin(np.linspace(0, 1, 50))[:, None] * [1.0, 1.0]
RIVALS = {"command_delay@a": WAVE, "actuator_lag@a": 1.01 * WAVE, "none of them": 0.0 * WAVE}
PLAYED = Experiment("multisine", ("a", "b"), np.linspace(0, 1, 50), WAVE, 4.0, "a", RIVALS, half_used(2))
ALIKE = replace(PLAYED, told=0.1, inseparable=(("command_delay@a", "actuator_lag@a"),))
UNSAFE = replace(PLAYED, told=0.0, predictions={}, safety=replace(half_used(2), margin=0.6))


@pytest.mark.parametrize(
    ("experiment", "said"),
    [
        (PLAYED, ["To decide, play next_experiment.csv", "Each should give 4 times the evidence", "actuator_lag@a",
                  "multisine at 64 % of full size, 1 s", "stop beyond: position", "-0.9 to 0.9 rad (URDF)",
                  "Stop when a joint goes beyond these limits", "none of them"]),
        (replace(PLAYED, told=9e7), ["To decide", "Each should give more than 100 times the evidence"]),
        (ALIKE, ["No command tried separates command_delay@a from actuator_lag@a"]),
        (UNSAFE, ["No safe command was found", "allowed: position"]),
    ],
    ids=["decides", "decides at once", "no command decides", "nothing is safe"],
)  # fmt: skip
def test_an_ambiguous_diagnosis_names_the_next_experiment(comparison, tmp_path, experiment, said) -> None:
    text = diagnosed(DIAGNOSIS | {"verdict": "ambiguous"}, comparison, tmp_path, experiment=experiment)
    assert [one for one in ("What to record next", *said) if one not in text] == []
    assert ("To decide" in text) == (said[0].startswith("To decide"))


def test_an_unknown_effect_shows_the_shape_of_the_residual(comparison: Comparison, tmp_path: Path) -> None:
    unknown = DIAGNOSIS | {"verdict": "unknown_effect", "effects": [], "unexplained_joints": ["b"]}
    left = {"joint": "b", "black_box": 0.93, "depends_most_on": "position of b", "beside": "the refitted model"}
    unknown |= {"partial_effects": DIAGNOSIS["effects"], "unexplained": [left]}
    x = np.linspace(-1, 1, 12)
    shape = Shape("b", "position of b [rad]", x, 0.01 * x, np.full(12, 0.002), 0.83)
    text = diagnosed(unknown, comparison, tmp_path, [shape])
    assert "explains 83 % of what the model lacks" in text
    assert "b: the torque missing in the refitted model follows position of b most; a black-box model" in text
    assert "could explain 93 %" in text
    assert "Some effects reduce the error, but more is missing." in text
    assert "The recommended model contains them: command_delay at a" in text
    assert "my_rig.MyEffect@b" in text


def test_what_the_trials_do_not_prove_is_named(comparison: Comparison, tmp_path: Path) -> None:
    maybe = {"effects": ["backlash@a"], "heldout_gain": 0.72, "p_value": 0.023, "segments": 8}
    unsure = DIAGNOSIS | {"verdict": "unknown_effect", "effects": [], "unproven_effects": [maybe]}
    text = diagnosed(unsure, comparison, tmp_path)
    assert "these trials are too few to prove what" in text
    assert "backlash@a would reduce the held-out squared error by 72 % (p 0.023)" in text
    assert "8 held-out windows are too few to rule out chance" in text


def test_texts_are_escaped(tmp_path: Path) -> None:
    section = Section("a", ["<script>alert(1)</script>"], [Table(("x",), [("<b>",)])])
    write_report(Report("t", "a", "good", [section], "f"), tmp_path / "r.html")
    assert "<script>" not in (tmp_path / "r.html").read_text()
    assert "<b>" not in (tmp_path / "r.html").read_text().split("</nav>")[1]
