"""Write the paper's results beside ours, from the results files of `evaluate`.

python -m benchmarks.paper                             # docs/results/paper.md; its prose is kept as it is written there
python -m benchmarks.paper --sweeps outputs/train/table1   # the tables of multiruns, nothing else
"""

import argparse
from pathlib import Path

from benchmarks.paper.page import paper_page, read_all
from benchmarks.paper.rows import read_comparison
from tactile_cube.evaluation.training_curve import RUN, read_sweep, sweep_table
from tactile_cube.training.run import FILE as FINISHED

RESULTS = Path(__file__).parents[2] / "docs" / "results"
TABLE_I = {
    "task=table, T_s 0.5 s": "0.3, 0.4, 0.3, 0.4",
    "task=float, T_s 0.5 s": "2.2, 1.7, 0.9, -",
    "task=full, T_s 0.5 s": "1.8, -, -, 2.3",
    "task=table, T_s 0.1 s": "0.4, 0.2, 0.2, 0.2",
    "task=float, T_s 0.1 s": "1.5, 5.8, -, 2.4",
    "task=full, T_s 0.1 s": "5.1, 1.7, 6.0, 3.9",
}
"""Million steps until regrasping of four runs; -: not within 6.5. Source: paper, Table I."""


def main() -> None:
    """Write the page, or print the tables of multiruns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweeps", nargs="*", type=Path, default=[], help="folders of multiruns: print their tables")
    parser.add_argument("--page", type=Path, default=RESULTS / "paper.md", help="file to write")
    given = parser.parse_args()
    for sweep in given.sweeps:
        curves = read_sweep(sweep)
        print(f"{sweep}\n\n{sweep_table(curves, TABLE_I if TABLE_I.keys() & curves else None)}\n")
        runs = [path for path in sorted(sweep.glob("*seed*")) if path.is_dir() and RUN.match(path.name)]
        if left := [run.name for run in runs if not (run / FINISHED).is_file()]:
            print(f"not finished: {', '.join(left)}")
    if given.sweeps:
        return
    written = (RESULTS / "paper.md").read_text(encoding="utf-8")
    page = paper_page(read_all(RESULTS / "runs"), read_comparison(RESULTS / "free_finger.json"), written)
    given.page.parent.mkdir(parents=True, exist_ok=True)
    given.page.write_text(page, encoding="utf-8")
    print(f"page: {given.page}")


if __name__ == "__main__":
    main()
