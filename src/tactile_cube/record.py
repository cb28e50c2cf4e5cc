"""Write a recording, from a simulated rig with hidden effects or from files of other programs."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("record")
def main(config: DictConfig) -> None:
    """Write the recording into `out`, read it back as every verb would, and say what it holds."""
    import sys
    from pathlib import Path

    import hydra.utils
    from omegaconf import OmegaConf

    from tactile_cube.errors import InputError
    from tactile_cube.measurement.recordings.reading import DESCRIPTION, read_recording
    from tactile_cube.measurement.recordings.writing import write_recording

    out = Path(config.out)
    if (out / DESCRIPTION).exists():
        raise InputError(f"out={out}: holds a recording already; choose another folder or remove it")
    settings = OmegaConf.to_container(config.source, resolve=True, throw_on_missing=True)
    source = hydra.utils.instantiate(settings)
    for name, tables in source.recordings(config.seed).items():
        write_recording(out / name, tables)
        recording = read_recording(out / name)
        for line in recording.warnings:
            print(f"warning: {line}", file=sys.stderr)
        seconds = sum(trial.duration for trial in recording.trials)
        kinds = ", ".join(dict.fromkeys(trial.kind for trial in recording.trials))
        joints = ", ".join(recording.joints)
        print(f"{out / name}: {len(recording.trials)} trials ({kinds}), {seconds:.0f} s, joints {joints}")
    print(f"next: python -m tactile_cube.compare recording={out}")


if __name__ == "__main__":
    main()
