"""The jobs of a sweep, in this process or wherever a launcher runs them."""

import hashlib
import json
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from hydra.core.hydra_config import HydraConfig
from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from tactile_cube.run_folder import INTERRUPTED

LONGEST = 180  # characters of a folder's name that stand for overrides; file systems allow 255 in all


class SweepFolder(Callback):
    """Hydra callback that keeps a sweep's folder for the process that begins it, see conf/hydra/default.yaml."""

    path: ClassVar[Path | None] = None

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        """Keep the folder."""
        SweepFolder.path = Path(config.hydra.sweep.dir)


class Jobs:
    """Runs the jobs of one command; launchers send it to other processes and machines.

    Args:
        job: what a job does with its configuration and its folder, and its objective for sweepers that search;
            SystemExit says that it failed.
    """

    def __init__(self, job: Callable[[DictConfig, Path], float | None]):
        self._job = job
        self._record = f".sweep-{secrets.token_hex(8)}"  # in the sweep's folder, which its machines share
        register_sweep_folder()

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        register_sweep_folder()

    def __call__(self, config: DictConfig) -> float | None:
        """Run one job; in a sweep, one that fails does not keep the others from running, and has no objective."""
        hydra = HydraConfig.get()
        folder, sweeping = Path(hydra.runtime.output_dir), hydra.mode == RunMode.MULTIRUN
        good, objective = True, None
        try:
            objective = self._job(config, folder)
        except SystemExit as end:
            if not sweeping or end.code == INTERRUPTED:
                raise
            good = False
        if sweeping:
            with Path(hydra.sweep.dir, self._record).open("a") as file:
                file.write(json.dumps([str(folder), good]) + "\n")
        return objective

    def ended(self) -> dict[Path, bool]:
        """Return folder -> whether its job succeeded, of all that ended; asked once, when all have."""
        record = SweepFolder.path and SweepFolder.path / self._record
        if not record or not record.is_file():
            return {}
        lines = [json.loads(line) for line in record.read_text().splitlines()]
        record.unlink()
        return {Path(folder): good for folder, good in lines}


def register_sweep_folder() -> None:
    """Let configurations say `${sweep_folder:...}`."""
    OmegaConf.register_new_resolver("sweep_folder", sweep_folder, replace=True)


def sweep_folder(overrides: str, seed: int) -> str:
    """Return the folder of one run of a sweep: what it overrides beside the seed, and the seed.

    Example:
        >>> sweep_folder("task=table-agent.gamma=0.9", 1), sweep_folder("", 1)
        ('task=table-agent.gamma=0.9-seed1', 'seed1')
    """
    setting = overrides.replace("/", "_")  # no folders within folders where a value is a path
    if len(setting) > LONGEST:
        setting = f"{setting[:LONGEST]}~{hashlib.sha256(setting.encode()).hexdigest()[:8]}"
    return f"{setting}-seed{seed}" if setting else f"seed{seed}"
