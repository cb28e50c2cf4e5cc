"""Find out which physical effect a model lacks, from a recording of the real mechanism."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb

SHAPES = 3  # of the missing torque of one joint, most telling first


@verb("diagnose")
def main(config: DictConfig) -> None:
    """Write diagnosis.json, model.yaml, report.html and diagnosis.rrd; print the answer in plain words."""
    import json
    import shlex
    import sys
    import time
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig

    from tactile_cube.drivetrain.effects import catalogue, find_effect
    from tactile_cube.drivetrain.model_file import read_model, write_model
    from tactile_cube.identification.contact.diagnosis import diagnose_contact, with_contact
    from tactile_cube.identification.contact.identification import stated_model
    from tactile_cube.identification.diagnosis import diagnose, write_experiment
    from tactile_cube.identification.diagnosis_json import as_json
    from tactile_cube.identification.in_words import answer
    from tactile_cube.identification.recommended import model_file
    from tactile_cube.measurement.bench import has_free_motion, with_object, without_touches
    from tactile_cube.measurement.comparing.comparison import compare
    from tactile_cube.measurement.recordings.reading import read_recording
    from tactile_cube.measurement.replay.parameters import require_same_joints
    from tactile_cube.visualization.comparison_episode import write_comparison
    from tactile_cube.visualization.comparison_summary import markdown
    from tactile_cube.visualization.contact_results import write_contact_diagnosis
    from tactile_cube.visualization.diagnosis_report import diagnosis_report
    from tactile_cube.visualization.report import write_report

    begin = time.perf_counter()
    folder = Path(HydraConfig.get().runtime.output_dir)
    everything = recording = read_recording(config.recording)
    for line in recording.warnings:
        print(f"warning: {line}", file=sys.stderr)
    known = read_model(config.model) if config.model else None
    if known is not None:
        require_same_joints(recording, known)
    effects = dict.fromkeys([*catalogue().values(), *(find_effect(name) for name in config.effects)])

    def say(line: str) -> None:
        print(f"[{time.perf_counter() - begin:5.1f} s] {line}", file=sys.stderr, flush=True)

    command = shlex.join(["python", "-m", "tactile_cube.diagnose", *sys.argv[1:]])
    if with_object(everything).trials and not has_free_motion(everything):
        grip = diagnose_contact(everything, known, config.step, config.seed, say)
        model = stated_model(everything, command, config.seed)
        if known is not None:
            model = known.model_copy(update={"provenance": model.provenance})
        model = grip.into(model, alone=True)
        write_contact_diagnosis(grip, model, folder, time.perf_counter() - begin)
        return
    recording = without_touches(everything)
    diagnosis = diagnose(recording, tuple(effects), config.engine, config.step, config.seed, say, known)
    model = model_file(recording, diagnosis.fitted, diagnosis.errors(), diagnosis.held_out, command, config.seed)
    result = as_json(diagnosis, write_experiment(diagnosis, folder), time.perf_counter() - begin)
    if known is not None:
        model = model.model_copy(update={"effects": model.with_effects(known.object_effects)})
        result["known_effects"] += [one.effect for one in known.object_effects]
    if with_object(everything).trials:
        grip = diagnose_contact(everything, model, config.step, config.seed, say)
        model, result = grip.into(model, alone=False), with_contact(result, grip)
        result["seconds"] = round(time.perf_counter() - begin, 2)
    write_model(model, folder / "model.yaml")
    (folder / "diagnosis.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    before = compare(recording, known, "fast", config.step, floor=diagnosis.floor)
    after = compare(recording, model, config.engine, config.step, floor=diagnosis.floor)
    shapes = [shape for one in diagnosis.unexplained for shape in one.shapes[:SHAPES]]
    path = str(folder / "model.yaml")
    page = diagnosis_report(result, before, after, command, path, shapes, diagnosis.experiment)
    write_report(page, folder / "report.html")
    write_comparison(after, folder / "diagnosis.rrd", markdown(after))
    print(answer(result, diagnosis.experiment))
    print(f"report: {folder / 'report.html'}")
    print(f"model: {folder / 'model.yaml'}\ndiagnosis: {folder / 'diagnosis.json'}")


if __name__ == "__main__":
    main()
