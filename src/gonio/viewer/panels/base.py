"""What a panel from outside is: a class that names it, and a JavaScript file beside it."""

from __future__ import annotations

import inspect
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...members import Family, subclasses_of


class Panel:
    """A tab of the page's dock, written outside of the page.

        class Grazing(go.Panel):
            name = "grazing"         # its code is grazing.js, in the folder of the file with this class

    The code calls `gonio.addPanel({id, title, mount(host, app), ...})`; web/src/panel.ts says what it may hold and what
    it is given. It runs with the page, in files that `--export` writes too: only packages that are installed and
    programs that register one bring panels, never a scene or a link.

    script  the JavaScript file, where it is not called by the name
    """

    name: ClassVar[str] = ""
    script: ClassVar[str] = ""
    family: ClassVar[Family[type[Panel]]]


Panel.family = Family("panel", "gonio.panels", (__package__,), subclasses_of(Panel))


def scripts() -> tuple[str, ...]:
    """The code of every panel, by their names in alphabetical order; InputError where a file is missing."""
    return tuple(
        _read(Path(inspect.getfile(panel)).parent / (panel.script or f"{name}.js"))
        for name, panel in Panel.family.all().items()
    )


@lru_cache  # the policy of a page names the text that was sent with it
def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError as error:
        what = f"a panel's code cannot be read: {error.strerror}"
        raise InputError(what, str(file), "put it beside the panel's Python file, or take the panel away") from None
