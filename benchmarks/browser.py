"""Time from a slider of the workbench to the curve that Chromium has drawn, and what a refit takes.

    python -m benchmarks.browser RECORDING --minutes 10

Needs Playwright (extra `dev`) and Chromium. The slider is the first one of the page's joint, the trial the first one.
Milliseconds are of the wall clock; processor seconds are the server's, and hold on a busy machine too.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
from playwright.sync_api import Page, sync_playwright

MOVES = 40
"""Moves of the slider before a line is printed."""
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
WAIT = 1_200_000  # [ms]
MOVE = """async (moves) => {
  const models = [...Bokeh.documents[0]._all_models.values()];
  const slider = models.find((one) => one.type === "Slider");
  const sources = models.filter((one) => one.type === "ColumnDataSource");
  const times = [];
  for (let k = 0; k < moves; k++) {
    let done;
    const drawn = new Promise((resolve) => (done = resolve));
    const seen = () => requestAnimationFrame(() => setTimeout(() => done(performance.now()), 0));
    sources.forEach((one) => one.change.connect(seen));
    const start = performance.now();
    slider.value = slider.start + (0.5 + 0.2 * Math.sin(k + 1 + Math.random())) * (slider.end - slider.start);
    times.push((await drawn) - start);
    sources.forEach((one) => one.change.disconnect(seen));
    await new Promise((resolve) => setTimeout(resolve, 150));
  }
  return [times, performance.memory.usedJSHeapSize / 2 ** 20];
}"""


@contextmanager
def workbench(*words: str, width: int = 1280) -> Iterator[tuple[Page, psutil.Process, Path]]:
    """Open a workbench in Chromium; yield its page, its server and the folder of its run."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        command = [sys.executable, "-m", "tactile_cube.workbench", "open=false", f"hydra.run.dir={folder}", *words]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                assert server.stdout is not None
                address = next(found.group() for line in server.stdout if (found := re.search(r"http://\S+", line)))
                page = browser.new_page(viewport={"width": width, "height": 900})
                page.set_default_timeout(WAIT)
                page.goto(address)
                page.get_by_role("button", name="Open").wait_for()
                yield page, psutil.Process(server.pid), Path(folder)
            finally:
                browser.close()
                server.terminate()


def processor_seconds(server: psutil.Process) -> float:
    """Return the processor time of the server and of the diagnoses that it started [s], ended ones included."""
    running = sum(sum(one.cpu_times()[:2]) for one in server.children(recursive=True))
    return float(sum(server.cpu_times()[:4]) + running)


def main() -> None:
    """Move a slider and print a line now and then; at last refit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("--minutes", type=float, default=0.5)
    args = parser.parse_args()
    with workbench(f"recording={args.recording}") as (page, server, _):
        page.get_by_role("radio").first.wait_for()
        start, moves, before = time.monotonic(), 0, processor_seconds(server)
        while time.monotonic() - start < 60.0 * args.minutes:
            times, heap = page.evaluate(MOVE, MOVES)
            moves += MOVES
            took = (processor_seconds(server) - before) / moves
            print(
                f"{(time.monotonic() - start) / 60:.1f} min, {moves} moves: {np.median(times):.0f} ms (median), "
                f"{max(times):.0f} ms (longest), {1e3 * took:.0f} ms of the server's processor a move; "
                f"server {server.memory_info().rss / 2**20:.0f} MiB, page {heap:.0f} MiB",
                flush=True,
            )
        start, before = time.monotonic(), processor_seconds(server)
        page.get_by_role("button", name="Refit", exact=True).click()
        page.get_by_role("cell", name="refitted", exact=True).nth(1).wait_for()
        clock, took = time.monotonic() - start, processor_seconds(server) - before
        print(f"refitted, judged and drawn: {clock:.1f} s, {took:.1f} s of the server's processor")


if __name__ == "__main__":
    main()
