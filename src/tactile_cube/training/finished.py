"""How a run ended: a sweep that is given again leaves it in peace."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from tactile_cube.whole_file import write_whole

FILE = "finished.json"


@dataclass(frozen=True)
class Finished:
    """The end of a run: reason in words, environment steps, mean final angle [rad], resolved configuration."""

    reason: str
    steps: int
    final_angle: float
    config: dict[str, Any]

    def write(self, folder: Path) -> None:
        """Write it into the run folder."""
        write_whole(folder / FILE, (json.dumps(asdict(self)) + "\n").encode())

    @classmethod
    def of(cls, folder: Path, config: dict[str, Any]) -> Self | None:
        """How the run in a folder ended under exactly these settings; None where it did not, or shall start over."""
        try:
            found = cls(**json.loads((folder / FILE).read_text()))
        except (OSError, ValueError, TypeError):
            return None
        # by way of JSON, in which tuples are lists
        same = found.config == json.loads(json.dumps(config)) and (folder / "policy.safetensors").is_file()
        return found if same and config["training"]["resume"] != "never" else None
