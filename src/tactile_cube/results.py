"""Write the paper's results beside ours, and the learning curves."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("results")
def main(config: DictConfig) -> None:
    """Gather results files and training runs into one page and one picture."""
    from pathlib import Path

    from tactile_cube.evaluation.paper_rows import read_comparison
    from tactile_cube.evaluation.paper_table import paper_page, read_all
    from tactile_cube.evaluation.sweep_table import read_sweep, sweep_table, unfinished
    from tactile_cube.evaluation.training_curve import read_curve
    from tactile_cube.visualization.curves import write_learning_curves, write_sweep_curves

    for file in (config.page, config.picture):
        Path(file).parent.mkdir(parents=True, exist_ok=True)
    if config.sweep is not None:
        runs = read_sweep(Path(config.sweep))
        print(f"{config.sweep}\n\n{sweep_table(runs, intervals=True)}\n")
        left = unfinished(Path(config.sweep))
        if left:
            print(f"not finished: {', '.join(left)}")
        write_sweep_curves(runs, Path(config.picture), config.title)
        print(f"learning curves: {config.picture}")
        return
    for sweep in config.sweeps:
        print(f"{sweep}\n\n{sweep_table(read_sweep(Path(sweep)))}\n")
    curves = [read_curve(Path(run), label=Path(run).stem) for run in config.curves]
    page = Path(config.page)
    table1 = read_sweep(Path(config.table1)) if config.table1 else {}
    free_finger = read_comparison(Path(config.free_finger)) if config.free_finger else None
    page.write_text(paper_page(read_all(Path(config.runs)), curves, table1, free_finger), encoding="utf-8")
    print(f"page: {page}")
    if curves:
        write_learning_curves(curves, Path(config.picture), config.title)
        print(f"learning curves: {config.picture}")


if __name__ == "__main__":
    main()
