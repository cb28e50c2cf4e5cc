"""Do memory, open files or logs of a training, or of many diagnoses in one process, grow?

    python -m benchmarks.faults.growth --minutes 20 --out outputs/reliability
    python -m benchmarks.faults.growth --minutes 20 --pid PID --folder RUN      # one that runs already
    python -m benchmarks.faults.growth --diagnoses 200 --out outputs/reliability

Writes growth.csv (one row each ten seconds, all processes of the run together) and growth.png; of diagnoses
diagnoses.csv (one row after each) and diagnoses.png.
"""

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

EVERY = 10.0
"""Seconds between two rows."""
COLUMNS = ("seconds", "resident_mb", "private_mb", "open_files", "threads", "log_kb", "steps")
SHOWN = {
    "private_mb": "memory [MB]", "open_files": "open files", "threads": "threads", "log_kb": "logs [kB]",
    "steps": "steps",
}  # fmt: skip
BENCH = {"source.joints": ["q3"], "source.duration": 3, "source.hidden": [], "source.validation": False}
"""One joint and trials of 3 s: a diagnosis is short."""
TRAINING = ("+experiment=smoke", "training.steps=100000000", "training.replay_size=20000", "name=growth")


def reading(process: psutil.Process, folder: Path, seconds: float) -> dict[str, float] | None:
    """One row; None when the process has ended.

    Args:
        process: the main process of a run.
        folder: the run's folder.
        seconds: since the first row.
    """
    try:
        family = [process, *process.children(recursive=True)]
        memory = [one.memory_full_info() for one in family]
        files, threads = sum(one.num_fds() for one in family), sum(one.num_threads() for one in family)
    except psutil.Error:
        return None
    logs = sum(path.stat().st_size for path in folder.rglob("*") if path.suffix in (".log", ".csv"))
    values = (
        round(seconds),
        round(sum(one.rss for one in memory) / 1e6, 1),
        round(sum(one.uss for one in memory) / 1e6, 1),
        files,
        threads,
        round(logs / 1e3, 1),
        _steps(folder),
    )
    return dict(zip(COLUMNS, values, strict=True))


def _steps(folder: Path) -> int:
    metrics = folder / "metrics.csv"
    lines = metrics.read_text().splitlines() if metrics.is_file() else []
    return int(float(lines[-1].partition(",")[0])) if len(lines) > 1 else 0


def watch(process: psutil.Process, folder: Path, minutes: float, out: Path) -> list[dict[str, float]]:
    """Write a row each ten seconds for so long, or until the process ends."""
    rows: list[dict[str, float]] = []
    out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with (out / "growth.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        while time.monotonic() - began < 60 * minutes:
            row = reading(process, folder, time.monotonic() - began)
            if row is None:
                break
            rows.append(row)
            table.writerow(row)
            file.flush()
            time.sleep(EVERY)
    return rows


def diagnose_often(number: int, out: Path) -> list[dict[str, float]]:
    """Diagnose one recording again and again in this process; a row after each, the steps being diagnoses."""
    import tactile_cube

    rows: list[dict[str, float]] = []
    out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as place, (out / "diagnoses.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        measured = tactile_cube.record(Path(place) / "bench", values=BENCH)[""]
        for done in range(1, number + 1):
            tactile_cube.diagnose(measured).write(Path(place) / "answer")
            row = reading(psutil.Process(), Path(place), time.monotonic() - began)
            if row is not None:
                rows.append(row | {"steps": done})
                table.writerow(rows[-1])
                file.flush()
    return rows


def draw(rows: list[dict[str, float]], path: Path, shown: dict[str, str]) -> None:
    """Draw columns over time; `shown`: column -> label."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 1.6 * len(shown)), layout="constrained")
    for axis, (name, label) in zip(figure.subplots(len(shown), 1, sharex=True), shown.items(), strict=True):
        axis.plot([row["seconds"] / 60 for row in rows], [row[name] for row in rows])
        axis.set(ylabel=label, ylim=(0, None))
        axis.grid(alpha=0.3)
    axis.set_xlabel("minutes")
    figure.savefig(path, dpi=100)


def main() -> None:
    """The command."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--minutes", type=float, default=20.0)
    words.add_argument("--out", type=Path, default=Path("outputs/growth"))
    words.add_argument("--pid", type=int)
    words.add_argument("--folder", type=Path)
    words.add_argument("--diagnoses", type=int)
    given = words.parse_args()
    if given.diagnoses is not None:
        rows = diagnose_often(given.diagnoses, given.out)
        shown = {name: label for name, label in SHOWN.items() if name != "log_kb"} | {"steps": "diagnoses"}
        draw(rows, given.out / "diagnoses.png", shown)
        return
    if given.pid is not None:
        rows = watch(psutil.Process(given.pid), given.folder, given.minutes, given.out)
    else:
        with tempfile.TemporaryDirectory() as place:
            command = [sys.executable, "-m", "tactile_cube.train", *TRAINING, f"hydra.run.dir={place}"]
            run = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            rows = watch(psutil.Process(run.pid), Path(place), given.minutes, given.out)
            run.terminate()
            run.wait(60)
    draw(rows, given.out / "growth.png", SHOWN)


if __name__ == "__main__":
    main()
