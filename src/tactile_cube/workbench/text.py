"""The one way of text into widgets: names and messages come from strangers' files, and are shown as they are written.

What is not printable (controls, NUL, right-to-left marks, halves of surrogates) is shown by its number, HTML is
escaped, and no TeX is rendered: the page has no MathJax, and labels of charts are plain text by their type.
"""

import base64
from collections.abc import Iterable, Sequence
from typing import Any, Self

from bokeh.models import Axis, Div, MultiSelect, PlainText, Select
from markupsafe import Markup

LABEL, MESSAGE = 60, 2000
"""Characters of a name in a list, and of a text, that are shown; the middle of longer ones is left out."""
Options = Sequence[str | tuple[str, str]]


def plain(text: object, most: int = LABEL) -> str:
    """Return a text as a widget may show it: one line of printable characters, at most `most` of what was given."""
    whole = str(text)
    if len(whole) > most:
        whole = f"{whole[: most - most // 3]} ... {whole[-(most // 3) :]}"
    return "".join(one if one.isprintable() else f"\\u{ord(one):04x}" for one in whole)


class Html(Markup):
    """HTML that this package wrote; what `format` and `join` put into it is escaped, unless it is of this kind."""

    @classmethod
    def escape(cls, s: Any, /) -> Self:
        """Return a value as HTML that shows it."""
        return s if isinstance(s, cls) else cls(Markup.escape(plain(s, MESSAGE)))


def html(*parts: str) -> Html:
    """Return parts one after the other; those that are not of this kind as text."""
    return Html("").join(parts)


def listed(lines: Iterable[str], style: str = "") -> Html:
    """Return lines, each below the last."""
    return html(*(Html('<div style="{}">{}</div>').format(style, line) for line in lines))


def show(pane: Div, *parts: str) -> None:
    """Put text, or HTML of this package's, into a pane."""
    text = str(html(*parts))
    if pane.text != text:
        pane.text = text


def choose(select: Select | MultiSelect, options: Options, keep: str = "") -> None:
    """Give a select other options, (value, label) or both in one; it keeps of its value what it still has."""
    pairs = [(one, one) if isinstance(one, str) else one for one in options]
    values, labels = [value for value, _ in pairs], [plain(label) for _, label in pairs]
    # the browser tells options apart by their labels
    shown = [f"{label} ({k})" if label in labels[:k] else label for k, label in enumerate(labels)]
    offered = list(zip(values, shown, strict=True))
    if select.options != offered:
        select.options = offered
    if isinstance(select, MultiSelect):
        select.value = [one for one in select.value if one in values]
    else:
        wanted = keep or select.value
        select.value = wanted if wanted in values else (values[0] if values else "")


def picture(alternative: str, png: bytes) -> Html:
    """Return a picture of this package's."""
    made = Html('<img alt="{}" style="max-width:100%" src="data:image/png;base64,{}">')
    return made.format(alternative, Html(base64.b64encode(png).decode("ascii")))


def label(axis: Axis, text: str) -> None:
    """Name an axis."""
    axis.axis_label = PlainText(text=plain(text))
