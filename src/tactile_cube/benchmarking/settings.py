"""What a run of the benchmark measures."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, PositiveInt


class RunSettings(BaseModel):
    """Top-level keys of the command.

    Attributes:
        sections: names, in the order in which they are run.
        rounds: samples a figure.
        peers: whether to measure other people's programs too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    sections: tuple[str, ...]
    rounds: PositiveInt
    peers: bool
