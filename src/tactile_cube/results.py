"""Write the paper's results beside ours, and the learning curves."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("results")
def main(config: DictConfig) -> None:
    """Gather results files and training runs into one page and one picture."""
    from pathlib import Path

    from tactile_cube.evaluation.paper_table import paper_page, read_all
    from tactile_cube.evaluation.training_curve import read_curve
    from tactile_cube.visualization.curves import write_learning_curves

    curves = [read_curve(Path(run), label=Path(run).stem) for run in config.curves]
    page = Path(config.page)
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(paper_page(read_all(Path(config.runs)), curves), encoding="utf-8")
    print(f"page: {page}")
    if curves:
        write_learning_curves(curves, Path(config.picture), config.title)
        print(f"learning curves: {config.picture}")


if __name__ == "__main__":
    main()
