"""The workbench as its user sees it: a real Chromium, the command as typed, one server for all tests.

WORKBENCH_PICTURES=DIR keeps a picture of each step.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars
import pytest

from tactile_cube.drivetrain.model_file import read_model
from tactile_cube.measurement.recordings.recording import Recording
from tests.workbench.small_bench import STRIBECK, stribeck_recording

pytest.importorskip("bokeh")
playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian: apt install chromium)")
PICTURES = os.environ.get("WORKBENCH_PICTURES")
PATIENCE = 120_000  # [ms]
FIRST = re.compile("% +stribeck_friction")  # not what looks like it
NAME = "<img src=x onerror=document.title='run'>"  # of a column, as a hostile log may have it
GIVEN = {
    "K_P [N m/rad]": "4.0", "K_D [N m s/rad]": "0.2", "torque limit [N m]": "4.0",
    "stiffness, if known": "40", "friction [N m]": "0.02", "rotor inertia [kg m^2]": "0.004",
}  # fmt: skip
DROP = """(files) => { const data = new DataTransfer();
for (const [name, text] of files) data.items.add(new File([text], name)); return data; }"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return stribeck_recording(tmp_path_factory.mktemp("stribeck"))


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """The address that the command prints, and its folder."""
    folder = tmp_path_factory.mktemp("out") / "run"
    words = [sys.executable, "-m", "tactile_cube.workbench", "open=false", f"hydra.run.dir={folder}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = next(found.group() for line in process.stdout if (found := re.search(r"http://\S+", line)))
        yield address, folder
        process.terminate()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def window(browser: Any, served: tuple[str, Path]) -> Iterator[Any]:
    """A window in which nothing fails and that asks no other machine for anything."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(PATIENCE)
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
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
    if PICTURES:
        window.wait_for_timeout(500)
        window.screenshot(path=f"{PICTURES}/{name}.png", full_page=True)


def drop(window: Any, *files: tuple[str, str]) -> None:
    data = window.evaluate_handle(DROP, [list(file) for file in files])
    window.dispatch_event("body", "drop", {"dataTransfer": data})


def open_recording(window: Any, recording: Recording) -> None:
    window.get_by_label("Folder of a recording").fill(str(recording.folder))
    window.get_by_role("button", name="Open").click()
    # the state may be that of another test until it is loaded
    window.get_by_role("cell", name=f"+ {STRIBECK}").wait_for(state="hidden")
    window.get_by_role("radio", name=FIRST).wait_for()


def over_noise(window: Any, stage: str) -> float:
    row = window.get_by_role("row").filter(has=window.get_by_role("cell", name=stage, exact=True))
    return float(row.get_by_role("cell").last.inner_text())


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


def test_from_dropped_logs_to_the_error_at_the_noise(
    window: Any, served: tuple[str, Path], measured: Recording
) -> None:
    drop(window, *logs(measured))
    window.get_by_text("still needed: the URDF of the rig").wait_for()
    drop(window, ("rig.urdf", measured.urdf))
    window.get_by_label("position", exact=True).last.wait_for()
    assert window.get_by_label("command", exact=True).input_value() == "goal_deg"
    for label, text in GIVEN.items():
        window.get_by_label(label).fill(text)
    picture(window, "1_import")
    window.get_by_role("button", name="Import").click()
    window.get_by_text("a position: angle_deg [deg] (its name)").wait_for()
    window.get_by_role("radio").first.wait_for()
    assert over_noise(window, "refitted") > 10.0
    picture(window, "2_compare")
    window.get_by_role("radio", name=FIRST).check()
    window.get_by_text("what stribeck_friction@a would supply").wait_for()
    window.get_by_text("what stribeck_friction@a would supply").wait_for(state="hidden")
    picture(window, "3_candidate")
    window.get_by_role("button", name="Add and refit").click()
    window.get_by_role("cell", name=f"+ {STRIBECK}").wait_for()
    assert over_noise(window, f"+ {STRIBECK}") < 1.1
    window.get_by_role("radio").first.wait_for()
    picture(window, "4_added")
    zoomed = "() => [...Bokeh.documents[0]._all_models.values()].some((one) => one.type == 'Range1d' && one.end < 1.0)"
    assert not window.evaluate(zoomed)
    window.locator(".bk-events").first.click(position={"x": 85, "y": 100})
    window.wait_for_function(zoomed)
    window.get_by_label("beside").select_option("1: refitted")
    window.get_by_label("where it fails").select_option(index=1)
    picture(window, "4_zoomed")
    window.get_by_role("button", name="Propose").click()
    window.get_by_text("times what decides").wait_for()
    with window.expect_download() as download:
        window.get_by_role("button", name="Download CSV").click()
    assert Path(download.value.path()).read_text().startswith("time,a.command\n")
    window.get_by_role("button", name="Save").click()
    window.get_by_text("+experiment=adapt").wait_for()
    picture(window, "5_saved")
    window.set_viewport_size({"width": 800, "height": 900})
    picture(window, "6_narrow")
    assert window.evaluate("document.documentElement.scrollWidth") <= 800
    assert read_model(served[1] / "model" / "model.yaml").effects[0].effect == STRIBECK


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


def test_a_diagnosis_is_stopped_in_the_middle_and_another_one_answers(window: Any, measured: Recording) -> None:
    open_recording(window, measured)
    window.get_by_role("button", name="Diagnose").click()
    window.get_by_text("base refitted").wait_for()
    window.get_by_role("button", name="Stop").click()
    window.get_by_text("stopped", exact=True).wait_for()
    assert window.get_by_role("button", name="Add what it found").is_disabled()
    window.get_by_role("button", name="Diagnose").click()
    window.locator("pre", has_text="stribeck_friction").wait_for()
    picture(window, "8_diagnosis")
    window.get_by_role("button", name="Add what it found").click()
    window.get_by_role("cell", name=f"+ {STRIBECK}").wait_for()
    assert over_noise(window, f"+ {STRIBECK}") < 1.1


def test_two_windows_show_one_state_and_the_keyboard_is_enough(
    window: Any, served: tuple[str, Path], measured: Recording
) -> None:
    open_recording(window, measured)
    other = window.context.browser.new_page()
    other.goto(served[0])
    other.get_by_role("cell", name="refitted", exact=True).wait_for()
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
    other.close()


def test_without_the_token_nothing_is_shown(browser: Any, served: tuple[str, Path]) -> None:
    page = browser.new_page()
    for address in (served[0].partition("?")[0], served[0] + "x"):
        page.goto(address)
        assert page.inner_text("body").strip() == "Open the address that the workbench printed."
    page.close()
