"""The command `gonio new`."""

from __future__ import annotations

import json
import keyword
import re
from pathlib import Path
from string import Template
from typing import Annotated

from typer import Argument

from ...errors import InputError, did_you_mean
from ..options import Json, output_option
from .base import MATERIALS, verb

TEMPLATES = Path(__file__).parents[1] / "templates"  # one folder per kind; $file and $title are placeholders


def _kinds() -> list[str]:
    return sorted(folder.name for folder in TEMPLATES.iterdir())


@verb(MATERIALS, place=9)
def new(
    kind: Annotated[str, Argument(metavar="material", help="Kind of file to create.", autocompletion=_kinds)],
    name: Annotated[str, Argument(metavar="NAME", help="Name of the material, such as velvet or crushed-velvet.")],
    output: Annotated[Path, output_option("DIR", "Folder for the material and its test.")] = Path(),
    as_json: Json = False,
) -> None:
    """Create a material of your own: a working example, NAME.py, and a passing test, test_NAME.py.

    \b
    Examples:
      gonio new material velvet
      gonio view velvet.py:Velvet
    """
    from ... import files

    if kind not in _kinds():
        raise InputError(f"no template for '{kind}'", "KIND", did_you_mean(kind, _kinds()))
    file, title = _names(name)
    folder = files.check_folder(output)
    contents = {}
    for template in sorted((TEMPLATES / kind).glob("*.py.txt")):
        target = folder / template.name.removesuffix(".txt").replace(kind, file)
        if target.exists():
            raise InputError(f"'{target}' already exists", "NAME", "choose another name, or another folder with -o")
        filled = Template(template.read_text(encoding="utf-8")).substitute(file=file, title=title)
        contents[target.name] = filled.encode()
    files.write_all(folder, contents)
    written = [str(folder / name) for name in contents]
    print(json.dumps({"written": written, "class": title}) if as_json else "\n".join(written))


def _names(name: str) -> tuple[str, str]:
    """The names of the file and the class: for "crushed-velvet", crushed_velvet and CrushedVelvet."""
    from ...material import models

    fine = re.fullmatch(r"[A-Za-z][\w-]*", name, re.ASCII)
    words = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name) if fine else []
    file, title = "_".join(words).lower(), "".join(word[0].upper() + word[1:] for word in words)
    if not words or keyword.iskeyword(file):
        raise InputError(f"'{name}' cannot name a Python file and a class", "NAME", "such as velvet, crushed-velvet")
    if file.replace("_", "-") in models():
        raise InputError(f"Gonio has a material '{name}'", "NAME", f"choose another, such as my-{name}")
    return file, title
