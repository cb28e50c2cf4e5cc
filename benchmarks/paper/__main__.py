"""Write the paper's results beside ours, from the results files of `evaluate`.

python -m benchmarks.paper                             # docs/results/paper.md; its prose is kept as it is written there
python -m benchmarks.paper --sweeps docs/results/levers    # the tables of multiruns, nothing else
"""

import argparse
from pathlib import Path

from benchmarks.paper.page import paper_page, read_all
from benchmarks.paper.rows import read_comparison
from tactile_cube.evaluation.sweep_table import RUN, read_sweep, sweep_table
from tactile_cube.evaluation.training_curve import read_curve
from tactile_cube.training.finished import FILE as FINISHED
from tactile_cube.visualization.curves import write_learning_curves

RESULTS = Path(__file__).parents[2] / "docs" / "results"


def main() -> None:
    """Gather results files and training runs into one page and one picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweeps", nargs="*", type=Path, default=[], help="folders of multiruns: print their tables")
    parser.add_argument("--page", type=Path, default=RESULTS / "paper.md", help="file to write")
    parser.add_argument("--picture", type=Path, help="file to write: the learning curves of all training runs")
    given = parser.parse_args()
    for sweep in given.sweeps:
        print(f"{sweep}\n\n{sweep_table(read_sweep(sweep), intervals=True)}\n")
        runs = [path for path in sorted(sweep.glob("*seed*")) if path.is_dir() and RUN.match(path.name)]
        if left := [run.name for run in runs if not (run / FINISHED).is_file()]:
            print(f"not finished: {', '.join(left)}")
    if given.sweeps:
        return
    files = [file for folder in ("curriculum", "table") for file in sorted((RESULTS / folder / "curves").glob("*.csv"))]
    curves = [read_curve(file, file.stem) for file in files if not file.stem.startswith("finetune")]
    written = (RESULTS / "paper.md").read_text(encoding="utf-8")
    results, table1 = read_all(RESULTS / "runs"), read_sweep(RESULTS / "table1")
    page = paper_page(results, curves, table1, read_comparison(RESULTS / "free_finger.json"), written)
    given.page.parent.mkdir(parents=True, exist_ok=True)
    given.page.write_text(page, encoding="utf-8")
    print(f"page: {given.page}")
    if given.picture:
        given.picture.parent.mkdir(parents=True, exist_ok=True)
        write_learning_curves(curves, given.picture, "mean final angle of the last 50 training episodes")
        print(f"learning curves: {given.picture}")


if __name__ == "__main__":
    main()
