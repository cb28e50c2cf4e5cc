"""The workbench as its user sees it: a real Chromium, the command as typed, one server for all tests.

WORKBENCH_PICTURES=DIR keeps a picture of each step.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import polars
import psutil
import pytest
import yaml

from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.identification.fitting.resolution import Fitted
from tactile_cube.identification.in_words import PARTIAL
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.workbench.background import Found
from tests.measurement.sources.bare_joint import LEVER, MASS, ROTOR, played
from tests.workbench.small_bench import STRIBECK

pytest.importorskip("bokeh")
pytest.importorskip("playwright.sync_api")

from playwright import sync_api as playwright

from benchmarks.browser import ARGUMENTS, processor_seconds
from benchmarks.walk import Walk

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian: apt install chromium)")
PICTURES = os.environ.get("WORKBENCH_PICTURES")
PATIENCE = 240_000  # [ms]
FIRST = re.compile("% +stribeck_friction")  # not what looks like it
STORY = ("Compare", "Missing torque", "What may be missing", "Diagnosis", "Error by stage", "Next experiment")
NAME = "<img src=x onerror=document.title='run'>"  # of a column, as a hostile log may have it
GIVEN = {
    "K_P [N m/rad]": "4.0", "K_D [N m s/rad]": "0.2", "torque limit [N m]": "4.0",
    "stiffness, if known": "40", "friction [N m]": "0.02", "rotor inertia [kg m^2]": "0.004",
}  # fmt: skip


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path, psutil.Process]]:
    """The address that the command prints, its folder and its process."""
    folder = tmp_path_factory.mktemp("out") / "run"
    words = [sys.executable, "-m", "tactile_cube.workbench", "open=false", f"hydra.run.dir={folder}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = next(found.group() for line in process.stdout if (found := re.search(r"http://\S+", line)))
        yield address, folder, psutil.Process(process.pid)
        process.terminate()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield started
        started.close()


@pytest.fixture
def window(browser: Any, served: tuple[str, Path, psutil.Process]) -> Iterator[Any]:
    """A window in which nothing fails and that asks no other machine for anything."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(PATIENCE)
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda said: wrong.append(said.text) if "Content Security Policy" in said.text else None)
    page.on(
        "request",
        lambda one: wrong.append(one.url) if not one.url.startswith((served[0][:16], "data:", "blob:")) else None,
    )
    page.goto(served[0])
    page.get_by_role("button", name="Open").wait_for()
    yield page
    assert wrong == []
    page.close()


def picture(window: Any, name: str) -> None:
    """Keep a picture of a step, narrow and wide."""
    for width in (800, 1280) if PICTURES else ():
        window.set_viewport_size({"width": width, "height": 900})
        window.wait_for_timeout(500)
        window.screenshot(path=f"{PICTURES}/{name}_{width}.png", full_page=True)


def drop(window: Any, *files: tuple[str, str]) -> None:
    Walk(window).drop(list(files))


def open_recording(window: Any, recording: Recording) -> None:
    window.get_by_label("Folder of a recording").fill(str(recording.folder))
    window.get_by_role("button", name="Open").click()
    # the state may be that of another test until it is loaded
    window.get_by_role("cell", name=f"+ {STRIBECK}").wait_for(state="hidden")
    window.get_by_role("radio", name=FIRST).wait_for()


def over_noise(window: Any, stage: str) -> float:
    row = window.get_by_role("row").filter(has=window.get_by_role("cell", name=stage, exact=True))
    return float(row.get_by_role("cell").nth(1).inner_text())


def logs(recording: Recording) -> list[tuple[str, str]]:
    """The trials as another program logs them: other names, degrees, milliseconds."""
    files = []
    for trial in recording.trials:
        columns = {
            "t_ms": 1e3 * trial.time,
            "goal_deg": np.degrees(trial.command[:, 0]),
            "angle_deg": np.degrees(trial.position[:, 0]),
            "temp": np.full(len(trial.time), 31.0),
        }
        files.append((f"{trial.name}.csv", polars.DataFrame(columns).write_csv()))
    return files


def test_from_dropped_logs_to_the_error_at_the_noise(window, served, measured) -> None:
    drop(window, *logs(measured))
    window.get_by_text("still needed: the URDF of the rig, or a choice of one joint").wait_for()
    drop(window, ("rig.urdf", measured.urdf))
    window.get_by_label("position", exact=True).last.wait_for()
    assert window.get_by_label("command", exact=True).input_value() == "goal_deg"
    window.get_by_role("button", name="More").click()
    window.get_by_label("a position is read").select_option("after")
    for label, text in GIVEN.items():
        window.get_by_label(label).fill(text)
    picture(window, "1_import")
    window.get_by_role("button", name="Import").click()
    window.get_by_text("a position: angle_deg [deg] (its name)").wait_for()
    window.get_by_role("radio").first.wait_for()
    assert over_noise(window, "refitted") > 10.0
    picture(window, "2_compare")
    window.set_viewport_size({"width": 800, "height": 900})
    heads = [window.get_by_role("heading", name=name, exact=True).bounding_box()["y"] for name in STORY]
    assert heads == sorted(heads)
    window.set_viewport_size({"width": 1280, "height": 900})
    window.get_by_role("radio", name=FIRST).check()
    window.get_by_text("what stribeck_friction@a would supply").wait_for()
    window.get_by_text("what stribeck_friction@a would supply").wait_for(state="hidden")
    window.get_by_text("error over noise would fall").wait_for()
    window.get_by_text("Confused with: backlash and elasticity").wait_for()
    assert window.get_by_label("over", exact=True).input_value() == "velocity of a [deg/s]", "as logged"
    picture(window, "3_candidate")
    window.get_by_role("button", name="Add and refit").click()
    window.get_by_role("cell", name=f"+ {STRIBECK}").wait_for()
    assert over_noise(window, f"+ {STRIBECK}") < 1.1
    window.get_by_role("radio").first.wait_for()
    assert window.get_by_role("radio", name=FIRST).count() == 0, "the model has it"
    assert window.locator("option", has_text=re.compile("^stribeck_friction$")).count() == 0
    picture(window, "4_added")
    window.get_by_label("beside").select_option("1: refitted")
    picture(window, "4_zoomed")
    window.get_by_role("button", name="Propose").click()
    window.get_by_text("times the evidence needed").wait_for()
    with window.expect_download() as download:
        window.get_by_role("link", name="Download CSV").click()
    assert Path(download.value.path()).read_text().startswith("time,a.command\n")
    window.get_by_role("button", name="Save").click()
    window.get_by_text("and report.html").wait_for()
    assert window.get_by_text("train in it").count() == 0, "a lever is no hand"
    picture(window, "5_saved")
    window.set_viewport_size({"width": 800, "height": 900})
    assert window.evaluate("document.documentElement.scrollWidth") <= 800
    assert read_model(served[1] / "model" / "model.yaml").effects[0].effect == STRIBECK


def test_from_a_bare_log_to_a_named_effect(window: Any, served: tuple[str, Path, psutil.Process]) -> None:
    walk, before = Walk(window), processor_seconds(served[2])
    bare = [(f"run_{seed}.csv", polars.DataFrame(played("pendulum", friction=0.08, seed=seed)).write_csv())
            for seed in (0, 0, 1, 1)]  # fmt: skip
    walk.drop([(name.replace("run", f"part{k}"), text) for k, (name, text) in enumerate(bare)])
    window.get_by_text("To be imported: part0_0.csv").wait_for()
    picture(window, "10_bare_log")
    walk.click("pendulum")
    window.get_by_label("position", exact=True).last.wait_for()
    walk.choose("a position is read", "after")
    picture(window, "11_one_joint")
    window.set_viewport_size({"width": 800, "height": 900})
    assert window.evaluate("document.documentElement.scrollWidth") <= 800
    window.set_viewport_size({"width": 1280, "height": 900})
    walk.click("Import")
    window.get_by_text("only the ratios are known").wait_for()
    window.get_by_role("cell", name="refitted", exact=True).wait_for()
    assert over_noise(window, "refitted") > 5.0
    stopped_in_the_middle(window)
    walk.click("Diagnose")
    window.locator("pre", has_text="coulomb_friction").wait_for(timeout=2 * PATIENCE)
    picture(window, "12_named")
    assert "friction 0.0133" in window.locator("pre").inner_text(), "0.08 N m at 6 N m/rad, of which 1 is made"
    stated = window.get_by_text("Error over noise with coulomb_friction@pendulum: ").inner_text()
    walk.click("Add what it found")
    window.get_by_role("cell", name="+ coulomb_friction@pendulum").wait_for()
    explained = over_noise(window, "+ coulomb_friction@pendulum")
    assert explained < 1.6
    newest = max(served[1].glob("diagnosis_*/diagnosis.json"), key=lambda path: path.stat().st_mtime)
    answer = json.loads(newest.read_text())["error_over_noise"]
    assert f"{explained:.2f}" == re.search(r": ([\d.]+)\.", stated).group(1)  # type: ignore[union-attr]
    assert [over_noise(window, "refitted"), explained] == [round(answer[k], 2) for k in ("refitted", "with_effects")]
    assert window.get_by_role("button", name="Add what it found").is_disabled()
    picture(window, "13_explained")
    assert walk.actions <= 40
    assert processor_seconds(served[2]) - before < 300.0, "five minutes on a processor of its own"


def stopped_in_the_middle(window: Any) -> None:
    """A first diagnosis, before the one that answers."""
    window.get_by_role("button", name="Diagnose").click()
    window.get_by_text("best so far: ").wait_for()
    window.get_by_text("% done in").wait_for()
    window.get_by_role("button", name="Stop").click()
    window.get_by_text("stopped", exact=True).wait_for()
    assert window.get_by_role("button", name="Add what it found").is_disabled()


WHEEL = """<link name="{0}"><inertial><mass value="{mass}"/><inertia ixx="{size}" iyy="{size}" izz="{size}" ixy="0"
ixz="0" iyz="0"/></inertial></link><joint name="{0}" type="continuous"><parent link="{1}"/><child link="{0}"/>
<axis xyz="{2}"/></joint>"""


def test_two_joints_of_different_gains_are_compared(window: Any, served: tuple[str, Path, psutil.Process]) -> None:
    gains = {"a": (25.0, 0.5), "b": (12.0, 0.3)}
    # a ball that turns across the axis which carries it: neither joint feels the other
    frame = WHEEL.format("a", "base", "0 0 1", mass=1e-6, size=1e-9)
    ball = WHEEL.format("b", "a", "1 0 0", mass=MASS, size=MASS * LEVER**2)
    files = [("rig.urdf", f'<robot name="two"><link name="base"/>{frame}{ball}</robot>')]
    for seed in range(4):
        logs = {name: played("wheel", seed=seed, gains=one) for name, one in gains.items()}
        columns = {"time": logs["a"]["time"]}
        for name, log in logs.items():
            columns |= {f"{name}_goal": np.degrees(log["goal"]), f"{name}_position": np.degrees(log["position"])}
        files.append((f"run_{seed}.csv", polars.DataFrame(columns).write_csv()))
    drop(window, *files)
    window.get_by_label("position", exact=True).nth(1).wait_for()
    window.get_by_role("button", name="More").click()
    given = {"K_P [N m/rad]": "25,12", "K_D [N m s/rad]": "0.5 0.3", "rotor inertia": str(ROTOR)}
    for label, text in given.items():
        window.get_by_label(label).fill(text)
    window.get_by_label("a position is read").select_option("after")
    window.get_by_label("angle in").select_option("deg")
    window.get_by_role("button", name="Import").click()
    window.get_by_role("cell", name="refitted", exact=True).wait_for()
    window.get_by_label("joint", exact=True).select_option("b")  # the page keeps the joint that was looked at before
    window.get_by_text("b in this trial").wait_for()
    newest = max(served[1].glob("recording_*/recording.yaml"), key=lambda path: path.stat().st_mtime)
    described = yaml.safe_load(newest.read_text())
    assert (described["controller"]["kp"], described["controller"]["kd"]) == ([25.0, 12.0], [0.5, 0.3])
    assert described["shown_in"] == {"a": "deg", "b": "deg"}
    assert over_noise(window, "refitted") < 2.0
    assert " deg RMS of the free run" in window.get_by_text("b in this trial").inner_text()
    window.get_by_label("joint", exact=True).select_option("a")
    window.get_by_text("a in this trial").wait_for()
    picture(window, "14_two_joints")


def test_a_folder_is_dropped_whole(window: Any, tmp_path: Path) -> None:
    log = played("wheel")
    lists = {"timestamp": log["time"], "action": log["goal"][:, None], "observation.state": log["position"][:, None]}
    (tmp_path / "set" / "data" / "chunk-000").mkdir(parents=True)
    (tmp_path / "set" / "meta" / "episodes").mkdir(parents=True)
    polars.DataFrame(lists).write_parquet(tmp_path / "set" / "data" / "chunk-000" / "file-000.parquet")
    polars.DataFrame({"episode_index": [0]}).write_parquet(tmp_path / "set" / "meta" / "episodes" / "file-000.parquet")
    named = {"names": ["shoulder.pos"]}
    info = {"features": {"action": named, "observation.state": named}}
    (tmp_path / "set" / "meta" / "info.json").write_text(json.dumps(info))
    devtools = window.context.new_cdp_session(window)
    data = {"items": [], "files": [str(tmp_path / "set")], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        devtools.send("Input.dispatchDragEvent", {"type": kind, "x": 200, "y": 600, "data": data})
    window.get_by_text("To be imported: chunk-000_file-000.parquet with").wait_for()
    window.get_by_role("button", name="wheel", exact=True).click()
    column = window.get_by_role("columnheader", name="action.shoulder.pos")
    column.wait_for()
    assert column.is_visible()


def test_a_wrong_file_is_named_with_what_to_do(window: Any, measured: Recording) -> None:
    drop(window, ("notes.pdf", "%PDF"))
    window.get_by_text("notes.pdf: neither a log (.csv").wait_for()
    name, text = logs(measured)[0]
    lines = text.split("\n")
    lines[7] = lines[7].replace(lines[7].partition(",")[0], "9", 1)
    lines[0] = lines[0].replace("temp", NAME + 150 * "x")
    drop(window, (name, "\n".join(lines)), ("rig.urdf", measured.urdf))
    window.get_by_role("columnheader", name=NAME).wait_for()
    window.set_viewport_size({"width": 800, "height": 900})
    window.wait_for_function("document.documentElement.scrollWidth <= 800")
    assert window.title() == "workbench"
    window.get_by_label("K_P [N m/rad]").fill("4.O")
    window.get_by_label("K_D").fill("0.2")
    window.get_by_role("button", name="Import").click()
    window.get_by_text("kp: '4.O' is no number").wait_for()
    window.get_by_label("K_P [N m/rad]").fill("4.0")
    window.get_by_role("button", name="Import").click()
    window.get_by_text(re.compile(rf"{name}.*row 7|{name}.*row 6")).wait_for()
    picture(window, "7_wrong_file")
    window.get_by_label("Folder of a recording").fill("/no/such/folder")
    window.get_by_role("button", name="Open").click()
    window.get_by_text("/no/such/folder: no recording's folder").wait_for()


def test_what_a_partial_answer_found_is_added(browser: Any, measured: Recording, tmp_path: Path) -> None:
    from tactile_cube.workbench.desk import Desk
    from tactile_cube.workbench.state import Workbench
    from tests.workbench.in_a_thread import served_in_a_thread

    desk = Desk(tmp_path)
    stage = (bench := Workbench(measured)).add(STRIBECK)
    fitted = Fitted(stage.fit.model, stage.fit, stage.half_width, 0.0 * stage.half_width)
    bench.undo()
    found = Found(PARTIAL, [STRIBECK], fitted, stage.over_noise, False)
    desk.bench, desk.outcome = bench, "done"
    desk.diagnosing = SimpleNamespace(found=found, said=[], stop=lambda: None)
    with served_in_a_thread(desk) as address:
        page = browser.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(address)
        page.get_by_text(PARTIAL).wait_for()
        page.get_by_role("button", name="Add what it found").click()
        page.get_by_role("cell", name=f"+ {STRIBECK}").wait_for()
        assert over_noise(page, f"+ {STRIBECK}") == round(stage.over_noise, 2)
        picture(page, "9_partial")
        page.close()


def test_a_number_is_typed_and_fixed(window: Any, measured: Recording) -> None:
    open_recording(window, measured)
    window.get_by_label("number", exact=True).select_option("kd@a")
    window.get_by_label("value", exact=True).fill("0.22")
    window.get_by_role("checkbox", name="fixed").check()
    window.get_by_role("button", name="Set", exact=True).click()
    window.get_by_role("cell", name="by hand").wait_for()
    window.get_by_role("button", name="Refit", exact=True).click()
    window.get_by_text(re.compile(r"kd \[N m s/rad\] fixed: 0.22")).wait_for()
    window.get_by_label("value", exact=True).fill("0.2O")
    window.get_by_role("button", name="Set", exact=True).click()
    window.get_by_text("'0.2O' is no number").wait_for()


def test_files_above_200_mb_are_refused_before_they_are_sent(window: Any, measured: Recording) -> None:
    said: list[str] = []
    window.on("dialog", lambda dialog: (said.append(dialog.message), dialog.dismiss()))
    pretend = "(size) => Object.defineProperty(File.prototype, 'size', {get: () => size, configurable: true})"
    window.evaluate(pretend, 201e6)
    drop(window, ("big.csv", "t\n1\n"))
    with window.expect_file_chooser() as chooser:
        window.locator("input[type=file]").click()
    chooser.value.set_files({"name": "big.csv", "mimeType": "text/csv", "buffer": b"t\n1\n"})
    window.evaluate(pretend, 199e6)
    drop(window, ("small.csv", "t\n1\n"))
    window.get_by_text("To be imported: small.csv").wait_for()
    assert said == 2 * ["more than 200 MB: name the path of the files instead"]


def test_two_windows_show_one_state_and_the_keyboard_is_enough(window, served, measured) -> None:
    open_recording(window, measured)
    other = window.context.browser.new_page()
    other.goto(served[0])
    other.get_by_role("cell", name="refitted", exact=True).first.wait_for()
    third = window.context.browser.new_context().new_page()
    third.goto(served[0].partition("enter")[0])
    radio = window.get_by_role("radio", name=FIRST)
    radio.focus()
    window.keyboard.press("Space")
    window.get_by_role("button", name="Add and refit").focus()
    window.keyboard.press("Enter")
    other.get_by_role("cell", name=f"+ {STRIBECK}").wait_for()
    window.get_by_text("stribeck_friction.excess").wait_for()  # its sliders have taken the place of those before
    window.get_by_role("slider").first.focus()
    window.keyboard.press("ArrowRight")
    other.get_by_role("cell", name="by hand").wait_for()
    other.get_by_role("button", name="Undo").click()
    window.get_by_role("cell", name="by hand").wait_for(state="hidden")
    assert third.inner_text("body").strip() == "Open the address that the workbench printed."
    third.context.close()
    other.close()


def test_without_the_token_nothing_is_shown_and_with_it_no_script_reads_it(browser, served) -> None:
    page = browser.new_page()
    token = served[0].partition("token=")[2]
    for address in (served[0].partition("enter")[0], served[0].partition("?")[0], served[0] + "x"):
        page.goto(address)
        assert page.inner_text("body").strip() == "Open the address that the workbench printed."
    page.goto(served[0])
    page.get_by_role("button", name="Open").wait_for()
    assert token not in page.url + page.content() + page.evaluate("document.cookie")
    page.close()


HREF = r"\href{javascript:document.title='run'}{q1}"
HOSTILE = {
    "a link as TeX": f"$${HREF}$$", "TeX in a line": rf"\({HREF}\)", "TeX in a block": rf"\[{HREF}\]",
    "TeX that loads": r"$$\require{html}\class{x}{y}$$", "a picture": NAME,
    "a script": "<script>document.title='run'</script>",
    "a link": "<a href=javascript:document.title='run'>x</a>", "an attribute": "\" onmouseover=\"document.title='run'",
    "the end of a text": "</pre></td></option><svg/onload=document.title='run'>", "a template": "{{7*7}}${7*7}#{7*7}",
    "an entity": "&lt;b&gt;", "NUL": "a\0b", "to the left": "a\u202egnp.b", "isolated": "\u2066a\u2069",
    "lines": "a\r\nb",
    "half a character": "a\ud800", "long": "x" * 10_000, "long words": "<b> " * 2_500, "nothing to see": "\u200b\u00ad",
}  # fmt: skip
DIVIDED = "".join(f"{0.01 * k:.2f},0.{k % 7},{{}}\n" for k in range(100))
WHEEL_OF = '<robot name="{}"><link name="base"/></robot>'
DROPPED = {  # name -> text, what the page says of it
    "empty.csv": ("", "empty CSV"),
    "nul.csv": (4 * "\0", "not a complete .csv file"),
    "page.csv": ("<!DOCTYPE html><script>document.title='run'</script>", "separated by blanks"),
    "wide.csv": (",".join(f"c{k}" for k in range(30_000)) + "\n" + 29_999 * "1," + "1\n", "holds 30000 columns"),
    "deep.json": (100_000 * "[", "no JSON of rows or columns"),
    "nan.csv": ("time,goal,position\n" + DIVIDED.format(*100 * ["nan"]), "'position' has no number in any row"),
    "inf.csv": ("time,goal,position\n" + DIVIDED.format(*100 * ["inf"]), "received inf"),
    "file.urdf": (
        '<!DOCTYPE r [<!ENTITY f SYSTEM "file:///etc/passwd">]>' + WHEEL_OF.format("&f;"),
        "not well-formed XML",
    ),
    "../../outside.csv": ("time,goal,position\n", "dropped/outside.csv: "),
    "run.py": ("import os", "run.py: neither a log"),
}
OPENED = {
    "model.yaml": ("joints: !!python/object/apply:os.system [touch owned]", "only plain data is read"),
    "recording.yaml": ("a: &a [" + 9 * "x," + "x]\n" + "".join(
        f"{new}: &{new} [{9 * f'*{old},'}*{old}]\n" for old, new in zip("abcdef", "bcdefg", strict=True)), "aliases"),
}  # fmt: skip


def test_hostile_files_are_refused_with_their_name_and_the_page_goes_on(window, served, measured, tmp_path) -> None:
    drop(window, ("first.csv", "time,goal,position\n" + DIVIDED.format(*range(100))))
    window.get_by_text("To be imported: first.csv").wait_for()
    window.get_by_role("button", name="wheel", exact=True).click()
    window.get_by_label("position", exact=True).last.wait_for()
    for name, (text, said) in DROPPED.items():
        drop(window, (name, text))
        if name in ("nan.csv", "inf.csv"):  # their columns can be shown
            window.get_by_text(f"To be imported: {name}").wait_for()
            window.get_by_role("button", name="Import").click()
        window.get_by_text(said).first.wait_for()
    for name, (text, said) in OPENED.items():
        (tmp_path / name).write_text(text)
        window.get_by_label("Folder of a recording").fill(str(tmp_path / name if name == "model.yaml" else tmp_path))
        window.get_by_role("button", name="Open").click()
        window.get_by_text(said).first.wait_for()
    nothing_ran(window)
    assert not list(served[1].parent.glob("**/owned"))
    assert not (served[1] / "outside.csv").exists()
    open_recording(window, measured)


WALK = """() => { const found = []; const walk = (root) => { for (const one of root.querySelectorAll("*")) {
  if (one.matches("img:not([src^='data:image/png']), iframe, object, embed, mjx-container, [onerror], [onload]") ||
    one.matches("[onmouseover], a:not([download])"))
    found.push(one.outerHTML);
  if (one.shadowRoot) walk(one.shadowRoot); } };
  walk(document.body); return found; }"""


def nothing_ran(window: Any) -> None:
    """What could run would be in the page when it has been drawn twice."""
    window.evaluate("() => new Promise(seen => requestAnimationFrame(() => requestAnimationFrame(seen)))")
    assert window.title() == "workbench"
    assert window.evaluate(WALK) == []
    assert window.evaluate("typeof MathJax") == "undefined"


TEXTS = """() => { const found = []; const walk = (root) => { for (const one of root.querySelectorAll("*")) {
  if (!one.matches("style, script")) found.push(one.childElementCount ? one.innerText : one.textContent);
  if (one.shadowRoot) walk(one.shadowRoot); } };
  walk(document.body); return found; }"""
ROOTS = ("status", "importing", "compare", "missing", "candidates", "diagnosis", "stages", "values", "next", "save")


def gallery(document: Any, desk: Any) -> None:
    """Every kind of widget of the workbench, once for each hostile name, by the functions that the page uses."""
    from bokeh.models import RadioGroup, Select, Slider
    from bokeh.plotting import figure

    from tactile_cube.workbench.text import Html, choose, html, label, listed, plain
    from tactile_cube.workbench.widgets import button, column_of, text_of

    names, select, chart = list(HOSTILE.values()), Select(title="s"), figure(width=300, height=2000)
    chart.toolbar.logo = None
    choose(select, names)
    label(chart.xaxis[0], "".join(names))
    label(chart.yaxis[0], names[0])
    for name in names:
        chart.line([0, 1], [0, 1], legend_label=plain(name))
    widgets = [select, RadioGroup(labels=[plain(f"radio {name}") for name in names]), chart]
    for name in names:
        cells = Html("<table><tr><td>{}</td></tr></table>").format(f"cell {name}")
        parts = text_of(html(listed([f"line {name}"]), cells, f"text {name}"))
        slider = Slider(start=0, end=1, value=0, step=0.1, title=plain(f"slider {name}"))
        widgets += [parts, slider, button(plain(f"button {name}"), print)]
    document.add_root(column_of(*widgets, name="open"))
    for name in ROOTS:
        document.add_root(column_of(name=name))


@pytest.fixture
def every_widget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Address of the gallery."""
    from tactile_cube.workbench import page
    from tactile_cube.workbench.desk import Desk
    from tests.workbench.in_a_thread import served_in_a_thread

    monkeypatch.setattr(page, "Page", gallery)
    with served_in_a_thread(Desk(tmp_path)) as address:
        yield address


def test_hostile_names_are_text_in_every_widget(browser: Any, every_widget: str) -> None:
    from tactile_cube.workbench.text import MESSAGE, plain

    page, wrong = browser.new_page(), []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    page.goto(every_widget)
    page.get_by_role("button", name="button &lt;b&gt;").wait_for()
    nothing_ran(page)
    texts = {one.strip() for one in page.evaluate(TEXTS)}
    for what, name in HOSTILE.items():
        for kind in ("radio", "button"):
            assert plain(f"{kind} {name}").strip() in texts, f"{what}: {kind}"
        for kind in ("line", "cell"):
            assert plain(f"{kind} {name}", MESSAGE).strip() in texts, f"{what}: {kind}"
        assert plain(name).strip() in texts, f"{what}: select, legend"
        assert plain(f"slider {name}") + ": 0" in {one.replace(": 0.0", ": 0") for one in texts}, what
    assert wrong == []
    page.close()


def test_hostile_names_of_joints_and_trials_are_text_in_the_page(window, measured, tmp_path) -> None:
    joint, text = f"$${HREF}$${NAME}", (measured.folder / "recording.yaml").read_text()
    described = yaml.safe_load(text) | {"joints": [joint]}
    for trial in described["trials"]:
        source = polars.read_parquet(measured.folder / trial["file"])
        trial["kind"], trial["file"] = trial["kind"] + "$$x$$\u202e", "\u202e<b>$$x$$" + trial["file"]
        renamed = source.rename({name: name.replace("a.", f"{joint}.", 1) for name in source.columns if name != "time"})
        renamed.write_parquet(tmp_path / trial["file"])
    (tmp_path / "recording.yaml").write_text(yaml.safe_dump(described))
    (tmp_path / "rig.urdf").write_text(measured.urdf.replace('name="a"', f"name={quoteattr(joint)}"))
    window.get_by_label("Folder of a recording").fill(str(tmp_path))
    window.get_by_role("button", name="Open").click()
    window.get_by_role("columnheader", name=joint, include_hidden=True).wait_for(state="attached")  # folded
    window.get_by_role("radio").first.wait_for()
    nothing_ran(window)
    window.reload()
    window.get_by_role("columnheader", name=joint, include_hidden=True).wait_for(state="attached")  # folded
    nothing_ran(window)
    window.get_by_role("radio", name=FIRST).check()
    window.get_by_role("button", name="Add and refit").click()
    window.get_by_role("cell", name=f"+ stribeck_friction@{joint}").wait_for()
    nothing_ran(window)


def test_hostile_names_are_text_in_the_form_of_an_import(window: Any, measured: Recording) -> None:
    name, text = logs(measured)[0]
    head, *rows = text.strip().split("\n")
    names = [one for one in HOSTILE.values() if one.isprintable() and '"' not in one and len(one) < 1000]
    quoted = ",".join('"' + one.replace('"', '""') + '"' for one in names)
    drop(
        window,
        (name, "\n".join([f"{head},{quoted}", *(row + ",1" * len(names) for row in rows)])),
        ("rig.urdf", measured.urdf),
    )
    for one in names:
        window.get_by_role("columnheader", name=one, exact=True).wait_for()
        assert window.get_by_label("command", exact=True).locator("option").filter(has_text=one).count() >= 1
    for one in HOSTILE.values():
        window.get_by_label("Folder of a recording").fill(f"/none/{one}")
        window.get_by_role("button", name="Open").click()
        window.get_by_text("and no file").or_(window.get_by_text("no name of a file")).first.wait_for()
        nothing_ran(window)
