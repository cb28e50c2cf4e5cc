"""Hook of MkDocs: what a page points to outside docs/ is named on the site, whose readers have no checkout."""

import re
from pathlib import Path
from typing import Any

LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s:#]+)(?:#[^)\s]*)?\)")


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Replace links that leave docs/ by their text; dead ones stay, for a strict build to find."""
    docs, place = Path(config.docs_dir), Path(page.file.abs_src_path).parent

    def shown(link: re.Match[str]) -> str:
        target = (place / link[2]).resolve()
        return link[1] if target.exists() and not target.is_relative_to(docs.resolve()) else link[0]

    return LINK.sub(shown, markdown)
