"""Train a policy, or go on training it: the same command resumes.

What a run writes into its folder: metrics.csv, tensorboard/, policy.safetensors (latest) and policy_best.safetensors,
checkpoint.pt (to go on from), ledger.json (CPU-hours) and .hydra/ (configuration).
"""

from typing import TYPE_CHECKING, Any

from tactile_cube.cli import verb

if TYPE_CHECKING:
    from omegaconf import DictConfig


@verb("train")
def main(config: "DictConfig") -> None:
    """Compose, build, train, say where the result is."""
    import sys
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode
    from hydra.utils import instantiate
    from omegaconf import OmegaConf

    from tactile_cube.drivetrain.model_file import read_model
    from tactile_cube.evaluation.policy_path import networks_path
    from tactile_cube.training.build import build_run
    from tactile_cube.training.collection import CollectionError
    from tactile_cube.training.environment import as_environment
    from tactile_cube.training.run import INTERRUPTED
    from tactile_cube.training.settings import CollectorSettings, RunSettings, TrainingSettings

    plain: dict[str, Any] = OmegaConf.to_container(config, resolve=True)  # type: ignore[assignment]
    if config.model is not None:  # its contents, so that the policy file needs no other file
        plain["env"]["model"] = read_model(config.model).model_dump()
    folder = Path(HydraConfig.get().runtime.output_dir)
    try:
        run = build_run(
            folder=folder,
            seed=RunSettings(name=config.name, seed=config.seed).seed,
            environment=as_environment(instantiate(config.env)),
            make_agent=instantiate(config.agent, _partial_=True),
            collector=CollectorSettings(**plain["collector"]),
            training=TrainingSettings(**plain["training"] | {"init_from": networks_path(config.training.init_from)}),
            loggers={name: instantiate(entry, _partial_=True) for name, entry in config.logger.items()},
            config=plain,
        )
        run.announce()
        reason = run.train()
    except CollectionError as error:
        print(f"error: {error}; the same command goes on from the last checkpoint in {folder}", file=sys.stderr)
        sys.exit(1)
    finally:
        if "run" in locals():
            run.close()
    run.conclude(reason)
    if reason == INTERRUPTED and HydraConfig.get().mode == RunMode.MULTIRUN:
        sys.exit(130)  # else Ctrl-C would end one run of a sweep and start the next


if __name__ == "__main__":
    main()
