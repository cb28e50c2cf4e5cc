"""Time from a slider of the workbench to the curve that Chromium has drawn, and memory while it is moved.

    python -m benchmarks.browser RECORDING --minutes 10

Needs Playwright (extra `dev`) and Chromium. The slider is the first one of the page's joint, the trial the first one.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np
import psutil
from playwright.sync_api import sync_playwright

MOVES = 40
"""Moves of the slider before a line is printed."""
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


def main() -> None:
    """Move a slider and print a line now and then."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording")
    parser.add_argument("--minutes", type=float, default=0.5)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        words = ("open=false", f"recording={args.recording}", f"hydra.run.dir={folder}")
        command = [sys.executable, "-m", "tactile_cube.workbench", *words]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            address = next(found.group() for line in server.stdout if (found := re.search(r"http://\S+", line)))
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.goto(address)
            page.get_by_role("radio").first.wait_for(timeout=300_000)
            start, moves = time.monotonic(), 0
            while time.monotonic() - start < 60.0 * args.minutes:
                times, heap = page.evaluate(MOVE, MOVES)
                moves += MOVES
                memory = psutil.Process(server.pid).memory_info().rss / 2**20
                print(
                    f"{(time.monotonic() - start) / 60:.1f} min, {moves} moves: {np.median(times):.0f} ms (median), "
                    f"{max(times):.0f} ms (longest); server {memory:.0f} MiB, page {heap:.0f} MiB",
                    flush=True,
                )
            browser.close()
            server.terminate()


if __name__ == "__main__":
    main()
