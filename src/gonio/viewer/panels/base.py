"""The base class of external panels, each of which consists of a Python class and a JavaScript file next to it."""

from __future__ import annotations

import inspect
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

from ...errors import InputError
from ...members import Family, subclasses_of


class Panel:
    """A tab below the page's picture, provided by another package.

        class Grazing(go.Panel):
            name = "grazing"         # its code is grazing.js, in the folder of the file with this class

    The code calls `gonio.addPanel({id, title, mount(host, app), ...})`; web/src/panel.ts defines the members and
    arguments. The code runs in the page and in files written by `--export`. Panels can be added only by installed
    packages and by programs that register them, never by a scene or a link.

    script  name of the JavaScript file, if it differs from that of the panel
    """

    name: ClassVar[str] = ""
    script: ClassVar[str] = ""
    family: ClassVar[Family[type[Panel]]]


Panel.family = Family("panel", "gonio.panels", (__package__,), subclasses_of(Panel))


def scripts() -> tuple[str, ...]:
    """The code of every panel, in alphabetical order of their names. Raises InputError if a file is missing."""
    return tuple(
        _read(Path(inspect.getfile(panel)).parent / (panel.script or f"{name}.js"))
        for name, panel in Panel.family.all().items()
    )


@lru_cache  # cached, because the page's policy contains the hash of this text
def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError as error:
        what = f"a panel's code cannot be read: {error.strerror}"
        raise InputError(what, str(file), "put it next to the panel's Python file, or remove the panel") from None
