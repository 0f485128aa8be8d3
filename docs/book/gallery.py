"""The gallery: a page for each folder in examples/, made from its README.md, and an index with all pictures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")


class Example(NamedTuple):
    """A folder in examples/, with its page."""

    folder: str
    title: str
    picture: str  # file name in the folder
    caption: str
    text: str


def examples() -> list[Example]:
    """All folders whose page shows a picture."""
    found = []
    for page in sorted(EXAMPLES.glob("*/README.md")):
        text = page.read_text(encoding="utf-8")
        picture = PICTURE.search(text)
        if picture:
            title = text.partition("\n")[0].removeprefix("# ")
            found.append(Example(page.parent.name, title, picture[2], picture[1], text))
    return found


def pages() -> dict[str, str | bytes]:
    """A page for each example, and the index."""
    made: dict[str, str | bytes] = {}
    for example in examples():
        made[f"gallery/{example.folder}.md"] = PICTURE.sub(
            lambda link, folder=example.folder: f"![{link[1]}](../../examples/{folder}/{link[2]})", example.text
        )
    cards = "\n".join(
        f"::::{{grid-item-card}} {example.title}\n:img-top: ../../examples/{example.folder}/{example.picture}\n"
        f":link: {example.folder}\n:link-type: doc\n::::"
        for example in examples()
    )
    listed = "\n".join(example.folder for example in examples())
    made["gallery/index.md"] = (
        "# Gallery\n\nEach page shows a picture with its scene and its command, and explains the picture.\n\n"
        f":::::{{grid}} 1 2 3 3\n:gutter: 2\n\n{cards}\n:::::\n\n:::{{toctree}}\n:hidden:\n\n{listed}\n:::\n"
    )
    return made
