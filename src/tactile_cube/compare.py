"""Simulate a recording's commands and show how far model and measurement are apart, and where."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("compare")
def main(config: DictConfig) -> None:
    """Write comparison.json, report.html and comparison.rrd; print the errors and where the model fails."""
    import json
    import shlex
    import sys
    import time
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig

    from tactile_cube.drivetrain.model_file import read_model
    from tactile_cube.identification.contact.comparison import compare_contact
    from tactile_cube.measurement.bench import has_free_motion, with_object, without_touches
    from tactile_cube.measurement.comparing.comparison import as_json, compare
    from tactile_cube.measurement.recordings.reading import read_recording
    from tactile_cube.visualization.comparison_report import comparison_report
    from tactile_cube.visualization.comparison_summary import markdown, summary
    from tactile_cube.visualization.report import write_report

    begin = time.perf_counter()
    folder = Path(HydraConfig.get().runtime.output_dir)
    model = read_model(config.model) if config.model is not None else None
    recording = read_recording(config.recording)
    for line in recording.warnings:
        print(f"warning: {line}", file=sys.stderr)

    def say(line: str) -> None:
        print(f"[{time.perf_counter() - begin:5.1f} s] {line}", file=sys.stderr, flush=True)

    held, free = len(with_object(recording).trials), has_free_motion(recording)
    if held and not free:
        comparison = compare_contact(recording, model, config.step, say)
    else:
        if held:
            say(f"{held} trials with an object are left out here; diagnose and identify use them")
        spread = {str(key): float(value) for key, value in config.band.spread.items()}
        band = (config.band.simulations, spread, config.seed)
        comparison = compare(without_touches(recording), model, config.engine, config.step, *band)
    command = shlex.join(["python", "-m", "tactile_cube.compare", *sys.argv[1:]])
    result = as_json(comparison) | {"model": config.model, "engine": config.engine, "command": command}
    result["seconds"] = round(time.perf_counter() - begin, 2)
    (folder / "comparison.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    write_report(comparison_report(comparison, command, config.model), folder / "report.html")
    if config.rerun:
        from tactile_cube.visualization.comparison_episode import write_comparison

        write_comparison(comparison, folder / "comparison.rrd", markdown(comparison))
    print(summary(comparison))
    print(f"report: {folder / 'report.html'}")


if __name__ == "__main__":
    main()
