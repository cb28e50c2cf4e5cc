"""The best episodes of an evaluation as film, stills, Rerun recording and replayable record."""

from __future__ import annotations

from pathlib import Path

from tactile_cube.evaluation.evaluation import Evaluation, VariantResult
from tactile_cube.evaluation.verdict import EpisodeResult
from tactile_cube.visualization.episode_recording import write_recording
from tactile_cube.visualization.film import write_film, write_stills


def showcase(evaluation: Evaluation, variants: list[VariantResult], folder: Path) -> None:
    """Run the best episodes of the first variant again and show them; say where and how to look.

    Args:
        evaluation: what ran the episodes.
        variants: what came of it.
        folder: where the files go.
    """
    first = variants[0]
    best = sorted(first.results, key=lambda result: result.final_angle, reverse=True)[: evaluation.protocol.film]
    for result in best:
        record = evaluation.record(first.variant, result)
        file = folder / f"episode{result.episode}"
        record.save(file.with_suffix(".npz"))
        hand = evaluation.hand
        write_film(record, file.with_suffix(".gif"), hand=hand)
        write_stills(record, file.with_suffix(".png"), every=max(5, record.steps // 30), hand=hand)
        write_recording(record, file.with_suffix(".rrd"), hand, summary=description(result))
        print(f"episode {result.episode}: {file}.gif, stills {file}.png; look inside: rerun {file}.rrd")


def description(result: EpisodeResult) -> str:
    """Return what is said beside the episode in the viewer, in Markdown."""
    lines = [f"# {result.verdict.value.replace('_', ' ')}", "", "| | |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in result.as_dict().items()]
    return "\n".join(lines)
