"""A self-contained HTML page that a stranger can read: what was done, what came out, how sure it is."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal

from jinja2 import Environment

from tactile_cube.whole_file import write_whole

Tone = Literal["good", "warn", "plain"]


@dataclass(frozen=True)
class Figure:
    """A drawing (SVG text of our own, which the page takes as it is) and what to see in it."""

    svg: str
    caption: str
    kind: Literal["figure"] = "figure"


@dataclass(frozen=True)
class Table:
    """A table; columns of numbers are right-aligned."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    kind: Literal["table"] = "table"

    @property
    def classes(self) -> list[str]:
        """Style of each column: `number` where every cell begins like a number."""
        columns = list(zip(*self.rows, strict=True)) or [() for _ in self.header]
        return ["number" if all(cell[:1] in "+-<0123456789" for cell in column) else "text" for column in columns]


@dataclass(frozen=True)
class Listing:
    """Sentences as a list, or a command to type (`code`)."""

    lines: Sequence[str]
    code: bool = False
    kind: Literal["listing"] = "listing"


Block = Figure | Table | Listing


@dataclass(frozen=True)
class Section:
    """A heading, what it means in a few sentences, and what was found."""

    title: str
    text: Sequence[str] = ()
    blocks: Sequence[Block] = ()
    folded: bool = False


@dataclass(frozen=True)
class Report:
    """A page: its title, the answer in a few lines, sections."""

    title: str
    answer: str
    tone: Tone
    sections: Sequence[Section]
    footer: str


def write_report(report: Report, path: Path) -> None:
    """Write the page; it needs no network and no other file."""
    template = resources.files(__package__).joinpath("report.html.jinja").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    write_whole(path, environment.from_string(template).render(report=report).encode())
