"""From bare logs of a real machine to a named effect, in Chromium: clicks and keys, processor time, pictures.

    python -m benchmarks.walk ../shared/data/sts3215 docs/images
    python -m benchmarks.walk ../shared/data/pendulum_torque

The first line makes the pictures of docs/workbench.md: a Feetech STS3215 under firmware gain 16 with 0.97 kg at 0.1 m,
six runs of time, goal and position (kscalelabs/sysid; not committed). The second line takes a pendulum
under torques (lvjonok/mujoco-sysid). A choice is two clicks, a text one and its keys. Needs Playwright and Chromium.
"""

import argparse
import io
import json
from pathlib import Path

import numpy as np
import polars
from PIL import Image
from playwright.sync_api import Page

from benchmarks.browser import processor_seconds, workbench

CONDITION = {"kp": 16, "mass": 0.969, "length": 0.1}
MOTIONS = ("brutal", "sin_sin", "up_and_down")
COLORS = 48  # of a picture: lines and text need few
DROP = """(files) => { const data = new DataTransfer();
for (const [name, text] of files) data.items.add(new File([text], name)); return data; }"""
Logs = list[tuple[str, str]]


def servo(folder: Path) -> Logs:
    """Time, goal and position of some runs of one condition."""
    columns = np.load(folder / "sts3215.npz")
    runs = [run for run in json.loads((folder / "runs.json").read_text()) if CONDITION.items() <= run.items()]
    runs = [run for run in runs if run["trajectory"] in MOTIONS]
    return [
        (
            f"{run['trajectory']}_{run['run']}.csv",
            _csv(columns, f"{run['run']:03d}.", ("time", "goal_position", "position")),
        )
        for run in runs
    ]


def pendulum(folder: Path) -> Logs:
    """Time, commanded torque and position of four trials."""
    columns = np.load(folder / "pendulum_torque.npz")
    names = sorted({name.partition(".")[0] for name in columns})
    return [(f"{name}.csv", _csv(columns, f"{name}.", ("time", "torque", "position"))) for name in names]


def _csv(columns: dict[str, np.ndarray], start: str, names: tuple[str, ...]) -> str:
    return polars.DataFrame({name: columns[start + name].astype(float) for name in names}).write_csv()


class Walk:
    """User of the page, whose clicks and keys are counted."""

    def __init__(self, page: Page, out: Path | None = None) -> None:
        self.page, self.out, self.actions = page, out, 0

    def drop(self, logs: Logs) -> None:
        """Drop files onto the page."""
        self.page.dispatch_event("body", "drop", {"dataTransfer": self.page.evaluate_handle(DROP, logs)})
        self.actions += 1

    def click(self, name: str) -> None:
        """Click a button."""
        self.page.get_by_role("button", name=name, exact=True).click()
        self.actions += 1

    def choose(self, label: str, option: str) -> None:
        """Choose a value of a select."""
        self.page.get_by_label(label, exact=True).select_option(option)
        self.actions += 2

    def type(self, label: str, text: str) -> None:
        """Type a text into a field."""
        self.page.get_by_label(label).fill(text)
        self.actions += 1 + len(text)

    def picture(self, name: str, height: float, heading: str = "", half: bool = False) -> None:
        """Save a picture of the window from a heading on, or of its right half, in few colours."""
        if self.out is None:
            return
        self.page.wait_for_timeout(3000)
        top = self.page.get_by_role("heading", name=heading, exact=True).bounding_box() if heading else None
        y = top["y"] + self.page.evaluate("scrollY") - 8.0 if top else 0.0
        x, width = (768.0, 512.0) if half else (0.0, 1280.0)
        shot = self.page.screenshot(full_page=True, clip={"x": x, "y": y, "width": width, "height": height})
        whole = Image.open(io.BytesIO(shot)).convert("RGB")
        whole.quantize(COLORS, dither=Image.Dither.NONE).save(self.out / f"workbench_{name}.png", optimize=True)


def main() -> None:
    """Walk."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("pictures", type=Path, nargs="?")
    args = parser.parse_args()
    of_servo = (args.data / "sts3215.npz").is_file()
    with workbench() as (page, server, _):
        walk = Walk(page, args.pictures)

        def say(what: str) -> None:
            took = processor_seconds(server)
            print(f"{what}: {walk.actions} clicks and keys, {took:.0f} s of the processor", flush=True)

        walk.drop(servo(args.data) if of_servo else pendulum(args.data))
        page.get_by_text("still needed").wait_for()
        walk.click("pendulum")
        page.get_by_label("position", exact=True).last.wait_for()
        if of_servo:
            walk.choose("servo", "sts3215_12v")
            walk.type("its firmware's gain", "16")
        else:
            walk.choose("commands are", "torque")
        walk.picture("import", 670.0)
        walk.click("Import")
        page.get_by_role("radio").first.wait_for()
        say("imported, candidates ranked")
        page.get_by_role("radio").first.check()
        walk.actions += 1
        page.get_by_text("error over noise would").wait_for()
        walk.picture("candidate", 860.0)
        walk.click("Diagnose")
        page.get_by_text("best so far").wait_for()
        page.get_by_text("% done").wait_for()
        page.locator("pre").wait_for()
        say("diagnosed")
        print(page.locator("pre").inner_text())
        walk.picture("diagnosis", 620.0, "Diagnosis")
        if not page.get_by_role("button", name="Add what it found").is_disabled():
            walk.click("Add what it found")
            page.get_by_role("cell", name="+ ").first.wait_for()
            page.get_by_role("radio").first.wait_for()
            say("added")
            walk.picture("added", 720.0)
            walk.picture("stages", 320.0, "Error by stage", half=True)
            walk.click("Propose")
            page.get_by_role("link", name="Download CSV").or_(page.get_by_text("decides nothing")).wait_for()
            walk.picture("next", 560.0, "Next experiment", half=True)
        walk.click("Save")
        page.get_by_text("and report.html").wait_for()
        say("saved")


if __name__ == "__main__":
    main()
