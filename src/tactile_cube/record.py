"""Write a recording, from a simulated rig with hidden effects or from files of other programs."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("record")
def main(config: DictConfig) -> None:
    """Write the recording into `out`, read back as every verb would, and say what it holds."""
    from pathlib import Path

    import hydra.utils
    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf

    from tactile_cube.measurement.recordings.whole import require_free, write_whole
    from tactile_cube.measurement.sources.missing import require_settings

    out = Path(config.out)
    require_free(out)
    require_settings(config.source, HydraConfig.get().runtime.choices["source"])
    source = hydra.utils.instantiate(OmegaConf.to_container(config.source, resolve=True))
    write_whole(out, source.recordings(config.seed))
    print(f"next: python -m tactile_cube.compare recording={out}")


if __name__ == "__main__":
    main()
