"""The results of a protocol as JSON: what was run, on what, and every episode."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from tactile_cube.agent.policy_file import current_commit
from tactile_cube.env import Task
from tactile_cube.errors import InputError
from tactile_cube.evaluation.evaluation import VariantResult
from tactile_cube.evaluation.policies import PolicySource
from tactile_cube.evaluation.protocol import Protocol

FORMAT = "tactile_cube results 1"
KEYS = ("created", "protocol", "policy", "task", "seed", "command", "cpu_hours", "variants")
"""What everybody who reads a results file relies on."""


@dataclass(frozen=True)
class EvaluationRun:
    """What was run: `engine` where a condition names none of its own; `worlds`: which options draw them."""

    protocol: Protocol
    source: PolicySource
    task: Task
    engine: str
    seed: int
    command: str
    cpu_hours: float
    worlds: Mapping[str, str]


def write_results(path: Path, run: EvaluationRun, variants: list[VariantResult]) -> None:
    """Write the results file."""
    data = {
        "format": FORMAT,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "protocol": run.protocol.name,
        "seconds": run.protocol.seconds,
        "success_share": run.protocol.success_share,
        "policy": {"label": run.source.label, **run.source.provenance},
        "task": asdict(run.task),
        "engine": run.engine,
        "worlds": dict(run.worlds),
        "seed": run.seed,
        "command": run.command,
        "cpu_hours": run.cpu_hours,
        "version": metadata.version("tactile-cube"),
        "commit": current_commit(),
        "variants": [variant.as_dict() for variant in variants],
    }
    path.write_text(
        json.dumps(data, indent=1, default=lambda one: one.tolist() if hasattr(one, "tolist") else str(one)),
        encoding="utf-8",
    )


def read_results(path: Path) -> dict[str, Any]:
    """Read a results file.

    Raises:
        InputError: it is missing, damaged or something else.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: not a results file of evaluate: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f"{path}: not a results file of evaluate (expected format {FORMAT!r})")
    missing = [key for key in KEYS if key not in data]
    if missing:
        raise InputError(f"{path}: results without {', '.join(missing)}; run evaluate again")
    return data
