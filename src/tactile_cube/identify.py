"""Fit a rig's constants and the effects that you name, and see the error fall."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("identify")
def main(config: DictConfig) -> None:
    """Write model.yaml, identification.json and report.html; print the staircase of errors."""
    import json
    import shlex
    import sys
    import time
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig

    from tactile_cube.drivetrain.model_file import write_model
    from tactile_cube.identification.contact.identification import contact_effects, identify_contact, stated_model
    from tactile_cube.identification.identification import identify
    from tactile_cube.identification.in_words import staircase
    from tactile_cube.identification.recommended import model_file
    from tactile_cube.measurement.bench import has_free_motion, without_touches
    from tactile_cube.measurement.bench_fit import BenchEstimates, bench_estimates
    from tactile_cube.measurement.comparing.comparison import compare
    from tactile_cube.measurement.recordings.reading import read_recording
    from tactile_cube.visualization.comparison_episode import write_comparison
    from tactile_cube.visualization.comparison_summary import markdown
    from tactile_cube.visualization.contact_report import contact_sections
    from tactile_cube.visualization.contact_results import write_contact_results
    from tactile_cube.visualization.diagnosis_report import identification_report
    from tactile_cube.visualization.report import write_report

    begin = time.perf_counter()
    folder = Path(HydraConfig.get().runtime.output_dir)
    recording = read_recording(config.recording)
    for line in recording.warnings:
        print(f"warning: {line}", file=sys.stderr)

    def say(line: str) -> None:
        print(f"[{time.perf_counter() - begin:5.1f} s] {line}", file=sys.stderr, flush=True)

    command = shlex.join(["python", "-m", "tactile_cube.identify", *sys.argv[1:]])
    everything, contact = recording, contact_effects(config.effects, recording)
    names = [effect.name for effect in contact]
    drive = [name for name in config.effects if name not in names]
    if contact and not drive and not has_free_motion(everything):
        held = identify_contact(everything, contact, None, config.step, config.seed, say)
        model = held.into(stated_model(everything, command, config.seed), alone=True)
        write_contact_results(held, model, folder, time.perf_counter() - begin)
        return
    offsets = bench_estimates(recording).offsets
    recording = without_touches(recording)
    found = identify(recording, drive, config.engine, config.step, config.seed, say)
    model = model_file(recording, found.fitted, found.errors(), found.held_out, command, config.seed)
    model = BenchEstimates(offsets=offsets).into(model)
    grip = identify_contact(everything, contact, model, config.step, config.seed, say) if contact else None
    model = model if grip is None else grip.into(model, alone=False)
    write_model(model, folder / "model.yaml")
    stages = {name: summary.overall for name, summary in found.stages.items()} | {"noise_floor": found.floor.overall}
    joints = {name: summary.joints for name, summary in found.stages.items()}
    result = {"error": stages, "joints": joints, "held_out": found.held_out, "model": model.model_dump()}
    result |= {} if grip is None else {"contact": grip.as_json()}
    result["seconds"] = round(time.perf_counter() - begin, 2)
    (folder / "identification.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    after = compare(recording, model, config.engine, config.step, floor=found.floor)
    held_sections = [] if grip is None else contact_sections(grip, alone=False)
    page = identification_report(after, stages, joints, command, str(folder / "model.yaml"), held_sections)
    write_report(page, folder / "report.html")
    write_comparison(after, folder / "identification.rrd", markdown(after))
    print(staircase(stages, model))
    print(f"model: {folder / 'model.yaml'}\nreport: {folder / 'report.html'}")


if __name__ == "__main__":
    main()
