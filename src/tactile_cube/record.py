"""Write a recording, from a simulated rig with hidden effects or from files of other programs."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("record")
def main(job: Job) -> None:
    """Write the recording into `out`, read back as every command would, and say what it holds."""
    from tactile_cube.api.recording import run_recording

    run_recording(job)
    print(f"next: python -m tactile_cube.compare recording={job.config.out}")


if __name__ == "__main__":
    main()
