"""An effect of the catalogue as a card: what it is, how it looks in data, what it is confused with, its picture."""

from __future__ import annotations

from importlib import resources

from tactile_cube.api.effects import effects
from tactile_cube.drivetrain.effects import catalogue
from tactile_cube.workbench.text import Html, html, listed, picture

CARD = Html('<div style="border:1px solid #d0d7de;border-radius:6px;padding:6px 10px"><b>{}</b>{}{}{}</div>')


def card(name: str, *lines: str) -> Html:
    """Return an effect of the catalogue, or a user's own by its name alone, with lines of the page's own."""
    if name not in catalogue():
        return CARD.format(name, listed(lines), "", "")
    (one,) = effects(name)
    notes = (f"{title}: {text}".replace("`", "") for title, text in one.notes.items() if title != "Source")
    return CARD.format(name, listed(lines), listed([one.summary, *notes]), _picture(name))


def _picture(name: str) -> Html:
    file = resources.files("tactile_cube.visualization").joinpath("effects", f"{name}.png")
    if not file.is_file():
        return html()
    return picture(f"measured less simulated angle without {name}", file.read_bytes())
