"""Write a recording, from a simulated rig with hidden effects or from files of other programs."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("record")
def main(config: DictConfig) -> None:
    """Write the recording into `out`, read back as every command would, and say what it holds."""
    from tactile_cube.api.job import typed_job
    from tactile_cube.api.recording import run_recording

    run_recording(typed_job(config))
    print(f"next: python -m tactile_cube.compare recording={config.out}")


if __name__ == "__main__":
    main()
