"""Find which physical effect a model lacks, from a recording of the machine."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("diagnose")
def main(job: Job) -> None:
    """Write diagnosis.json, model.yaml, report.html and diagnosis.rrd; print the answer in plain words."""
    from tactile_cube.api.diagnosis import run_diagnosis

    found = run_diagnosis(job, job.config.recording, job.config.model)
    found.write(job.folder)
    print(found.text)
    for name, file in {"report": "report.html", "model": "model.yaml", "diagnosis": "diagnosis.json"}.items():
        print(f"{name}: {job.folder / file}")


if __name__ == "__main__":
    main()
