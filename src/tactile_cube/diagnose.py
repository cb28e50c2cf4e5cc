"""Find which physical effect a model lacks, from a recording of the machine."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command

FILES = {"report": "report.html", "model": "model.yaml", "diagnosis": "diagnosis.json"}


@command("diagnose")
def main(config: DictConfig) -> None:
    """Write diagnosis.json, model.yaml, report.html and diagnosis.rrd; print the answer in plain words."""
    from tactile_cube.api.comparison import modelled, opened
    from tactile_cube.api.diagnosis import run_diagnosis
    from tactile_cube.api.job import typed_job

    job = typed_job(config)
    found = run_diagnosis(job, opened(config.recording), modelled(config.model), job.say)
    found.write(job.folder)
    print(found.text)
    print(*(f"{name}: {job.folder / file}" for name, file in FILES.items()), sep="\n")


if __name__ == "__main__":
    main()
