"""The list of a report's figures: a report.toml, or the options of the command line."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from ..catalog import outside
from ..errors import InputError
from ..scene.reader import explain
from .entries import Bake, Check, Figure, PictureKeys, Plot, Render, Study

LIST_FILE = "report.toml"
MAX_BYTES = 1 << 20  # size of a list, which is written by hand
WORDS = frozenset({"title", "author", "heading", "caption", "text"})  # keys whose values are prose, not file names
_OUTSIDE = re.compile(r"(?:^|[=,(\s])(?:/|~|[A-Za-z]:\\|\.\.(?:[/\\]|$))|[/\\]\.\.(?:[/\\]|$)")
_KIND = re.compile(r"(lobe|slice|albedo|image)=(.*)", re.DOTALL)


class ListFile(PictureKeys):
    """A report.toml: title and author of the document, options of all pictures, and the figures in order."""

    title: str = ""
    author: str = ""
    scene: str = ""
    """The scene of figures without a scene of their own; by default, the folder of the list if it contains a
    scene.json."""
    figure: list[Annotated[Render | Study | Plot | Bake | Check, Field(discriminator="type")]]


@dataclass(frozen=True)
class Listing:
    """The figures of a report in order.

    locations  the location of each figure's declaration: a file with a JSON pointer, or an option
    folder     the folder to which the paths of the figures are relative
    """

    title: str
    author: str
    figures: Sequence[Figure]
    locations: Sequence[str]
    folder: Path
    name: str


def listing(target: str, options: Mapping[str, Sequence[str] | None], allow_code: bool, allow_outside: bool) -> Listing:
    """The list in a .toml, or in the report.toml of a scene's folder if no option specifies figures; otherwise, the
    list given by the options.

    target   a .toml, a scene or a material
    options  the values of "study", "plot", "bake" and "work"
    Raises InputError, with file and key, for an invalid list.
    """
    path, given = Path(os.path.expanduser(target)), any(options.values())
    file = path if path.suffix.lower() == ".toml" else path / LIST_FILE
    if path.suffix.lower() == ".toml" or (not given and file.is_file()):
        if given:
            option = next(name for name, texts in options.items() if texts)
            raise InputError(f"--{option} given with a list", f"--{option}", f"add a [[figure]] to {file}")
        return _read(file, allow_code, allow_outside)
    figures = list(_of_options(target, options))
    name = path.resolve().stem if os.path.exists(path) else re.sub(r"\W.*", "", target) or "material"
    return Listing("", "", [one for one, _ in figures], [where for _, where in figures], Path.cwd(), name)


def _read(file: Path, allow_code: bool, allow_outside: bool) -> Listing:
    raw = _toml(file)
    try:
        content = ListFile.model_validate(raw)
    except ValidationError as error:
        problem = explain(error, raw, file)
        hint = "" if "gonio schema" in problem.hint else problem.hint
        raise InputError(problem.what, problem.where, hint or "docs/report.md lists the keys") from None
    _check_names(raw, file, allow_code, allow_outside)
    folder = file.resolve().parent
    scene = content.scene or ("." if (folder / "scene.json").is_file() else "")
    figures = [one.with_defaults(content, scene) for one in content.figure]
    if not figures:
        raise InputError("no figure is listed", f"{file}#/figure", 'add [[figure]] with type = "study"')
    name = file.stem if file.name != LIST_FILE else folder.name
    where = [f"{file}#/figure/{index}" for index in range(len(figures))]
    return Listing(content.title, content.author, figures, where, folder, name)


def _toml(file: Path) -> dict[str, Any]:
    try:
        if file.stat().st_size > MAX_BYTES:
            raise InputError("larger than 1 MiB, not a list of figures", str(file), "give a report.toml")
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be opened: {error.strerror}", str(file), "check the path") from None
    except UnicodeDecodeError:
        raise InputError("not UTF-8 text", str(file), "save it as UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        what = f"not valid TOML: {str(error)[:200]}"
        raise InputError(what, str(file), 'strings are in double quotes: type = "study"') from None


def _check_names(raw: Mapping[str, Any], file: Path, allow_code: bool, allow_outside: bool) -> None:
    """Raise InputError if the list refers to Python files or to files outside its folder, unless this is allowed."""
    for pointer, text in _strings(raw, ""):
        if not allow_code and (outside.names_code(text.partition("(")[0]) or ".py:" in text):
            raise InputError(f"'{text}' runs a Python file", f"{file}#{pointer}", "add --allow-code if you trust it")
        if not allow_outside and (_OUTSIDE.search(text) or _leads_out(file.parent, text)):
            what = f"'{text}' is outside the list's folder"
            raise InputError(what, f"{file}#{pointer}", "move it there, or add --allow-outside")


def _leads_out(folder: Path, text: str) -> bool:
    """Whether a path, with links resolved, is outside the folder."""
    try:
        path = (folder / text).resolve()
        return path.exists() and not path.is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False  # not a path


def _strings(value: object, pointer: str) -> Iterator[tuple[str, str]]:
    """All strings that may refer to files or code, each with its JSON pointer."""
    if isinstance(value, str):
        yield pointer, value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            if key not in WORDS:
                yield from _strings(item, f"{pointer}/{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _strings(item, f"{pointer}/{index}")


def _of_options(target: str, options: Mapping[str, Sequence[str] | None]) -> Iterator[tuple[Figure, str]]:
    """The scene itself, followed by the figures specified by the options, each with its option."""
    yield Render(type="render", scene=target), "TARGET"
    for text in options.get("study") or ():
        yield Study(type="study", scene=target, vary=_parts(text)), "--study"
    for text in options.get("plot") or ():
        match = _KIND.fullmatch(text)
        kind: Literal["lobe", "slice", "albedo", "image"] = match[1] if match else "lobe"  # type: ignore[assignment]
        yield Plot(type="plot", model=_parts(match[2] if match else text), kind=kind), "--plot"
    for text in options.get("bake") or ():
        yield Bake(type="bake", target=text), "--bake"
    for text in options.get("work") or ():
        work, *against = _parts(text)
        yield Check(type="check", work=work, against="".join(against)), "--work"


def _parts(text: str) -> list[str]:
    """The parts of an option between semicolons."""
    return [part.strip() for part in text.split(";") if part.strip()] or [text]
