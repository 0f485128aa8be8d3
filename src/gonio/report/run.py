"""`gonio report` and `go.report`: create the figures of a list, and the document that contains them."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Unpack

from .. import files
from ..bridge import engine
from ..errors import GonioWarning, InputError
from ..files import write_whole
from ..owner import public
from ..render.options import RenderKeywords, RenderOptions, takes_render_options
from . import document, printing, words
from .entries import Facts, Figure, Making, as_csv
from .listing import Listing, listing

MADE_FILE = "made.json"  # in the folder of figures: hashes of the inputs of each figure, to skip unchanged figures


@dataclass(frozen=True)
class Report:
    """The result of `report`: the files of a lab report.

    output     the page, a single file that needs no network
    words      report.md, which is edited by its author
    pdf        the printed page; None if it was not requested
    figures    files of the figures, in order
    unchanged  number of figures that were up to date
    new_words  whether this call created report.md
    unused     lines to insert into report.md, one for each figure that it does not include
    """

    output: Path
    words: Path
    pdf: Path | None
    figures: tuple[Path, ...]
    unchanged: int
    new_words: bool
    unused: tuple[str, ...]
    warnings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        plain = {name: str(value) if isinstance(value, Path) else value for name, value in vars(self).items()}
        return {**plain, "figures": [str(path) for path in self.figures]}


@public
@takes_render_options
def report(
    target: str | Path,
    *,
    study: Sequence[str] | None = None,
    plot: Sequence[str] | None = None,
    bake: Sequence[str] | None = None,
    work: Sequence[str] | None = None,
    title: str = "",
    pdf: bool = False,
    output: str | Path | None = None,
    **options: Unpack[RenderKeywords],
) -> Report:
    """Create a lab report from pictures, contact sheets, plots, tables, verdicts and text of your own.

        go.report("examples/phong", study=["shapes.1.material.p=4,16,64"], plot=["slice=phong(p=16)"])
        go.report("lab2.toml", pdf=True)

    target  a list of figures (.toml), a scene or a material; a scene's folder may contain a report.toml
    study   contact sheets of the scene; each has one variation, "NAME=V1,V2", or two, separated by a semicolon, for a
            grid
    plot    materials to plot, separated by semicolons, as lobes; "slice=phong(p=4)" selects another kind of plot
    bake    distributions or materials whose albedo tables are included
    work    your own work to check: "f.csv; oren-nayar(sigma=0.3)"
    title   heading of a new report.md
    pdf     also print the page to a PDF file, with a Chromium browser installed on this machine
    output  folder of the report; None selects NAME-report in the current folder
    The folder contains report.md, report.html and the figures. report.md is written only if it is missing: edit its
    text, and call the function again. Unchanged figures are not created again.
    Other options are as in `go.render`, for all pictures. Returns a Report. Raises InputError for an invalid list,
    scene or option, MachineError if this machine cannot render the pictures or print the page.
    """
    lists = {"study": study, "plot": plot, "bake": bake, "work": work}
    tell = functools.partial(warnings.warn, category=GonioWarning, stacklevel=3)
    with engine.put_back():
        result = write(str(target), lists, RenderOptions(**options), output, title, pdf, tell=tell)
    for text in result.warnings:
        warnings.warn(text, GonioWarning, stacklevel=4)
    return result


def write(
    target: str,
    lists: dict[str, Sequence[str] | None],
    options: RenderOptions,
    output: str | Path | None = None,
    title: str = "",
    pdf: bool = False,
    step: Callable[[int, int, str], None] = lambda done, total, state: None,
    tell: Callable[[str], None] = lambda text: None,
) -> Report:
    """Create the figures and the document.

    lists  the values of "study", "plot", "bake" and "work"
    step   called before each figure, with the number of completed figures, their total number, and the name of the next
           figure
    tell   called with notices about results of an earlier run
    The other arguments are as in `report`.
    """
    content = listing(target, lists, options.allow_code, options.allow_outside)
    folder = files.check_folder(Path(f"{content.name}-report") if output is None else output).absolute()
    if pdf:
        printing.browser()
    names = _file_names(content)
    text_file = folder / words.WORDS_FILE
    text = _read(text_file)
    if text is not None:
        words.check_references(text, folder, {*names, words.SETTINGS}, options.allow_outside)
    making = Making(options, folder / words.FOLDER, tell)
    with contextlib.chdir(content.folder):
        facts, unchanged = _make(content, names, making, step)
    _write_settings(content, names, facts, making)
    figures = list(zip(names, content.figures, strict=True))
    if text is None:
        heading = title or content.title or content.name
        write_whole(text_file, words.first_words(heading, content.author, figures).encode())
    shown = text_file.read_text(encoding="utf-8")
    page = write_whole(folder / "report.html", document.page(shown, folder, options.allow_outside).encode())
    targets = {reference.target for reference in words.references(shown)}
    unused = [words.inclusion(name, figure) for name, figure in figures if f"{words.FOLDER}/{name}" not in targets]
    notices = dict.fromkeys(f"{name}: {text}" for name, one in zip(names, facts, strict=True) for text in one.warnings)
    return Report(
        page,
        text_file,
        printing.write_pdf(page, folder / "report.pdf") if pdf else None,
        tuple(making.folder / name for name in names),
        unchanged,
        text is None,
        tuple(unused),
        tuple(notices),
    )


def _read(file: Path) -> str | None:
    """The text of report.md; None if the file does not exist. Raises InputError if it is not a text file."""
    try:
        return file.read_text(encoding="utf-8") if os.path.lexists(file) else None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read as text in UTF-8: {error}", str(file), "save it as UTF-8") from None


def _file_names(content: Listing) -> list[str]:
    """The file name of each figure: its given name, or one derived from its title. Raises InputError for duplicates."""
    names: dict[str, str] = {}
    for figure, location in zip(content.figures, content.locations, strict=True):
        base = figure.name or re.sub(r"[^a-z0-9]+", "-", figure.title().lower()).strip("-")[:48] or figure.type
        unique = next(
            name for count in range(1, 1000) if (name := base if count == 1 else f"{base}-{count}") not in names
        )
        if figure.name and unique != base:
            raise InputError(f"two figures are called '{base}'", f"{location}/name", f"first in {names[base]}")
        names[unique] = location
    return [name + figure.suffix for name, figure in zip(names, content.figures, strict=True)]


def _make(
    content: Listing, names: Sequence[str], making: Making, step: Callable[[int, int, str], None]
) -> tuple[list[Facts], int]:
    """Create each figure that has changed. Returns the facts of all figures, and the number of unchanged figures."""
    total = len(names)
    todo: list[tuple[str, Figure, str]] = list(zip(names, content.figures, content.locations, strict=True))
    identities = []
    for name, figure, location in todo:  # check all before making the first
        step(0, total, f"checking {name}")
        with _located(location):
            identities.append(figure.identity(making))
    making.folder.mkdir(parents=True, exist_ok=True)  # only now, so that a rejected report leaves nothing behind
    before = _made_before(making.folder)
    facts: list[Facts] = []
    unchanged = 0
    for (name, figure, location), identity in zip(todo, identities, strict=True):
        step(len(facts), total, name)
        last = before.get(name, {})
        if identity and last.get("identity") == identity and (making.folder / name).is_file():
            unchanged += 1
            facts.append(Facts(str(last.get("settings", ""))))
            continue
        with _located(location):
            facts.append(figure.make(making, making.folder / name))
        before[name] = {"identity": identity, "settings": facts[-1].settings}
        write_whole(making.folder / MADE_FILE, (json.dumps(before, indent=1) + "\n").encode())
    step(total, total, "the document")
    return facts, unchanged


@contextlib.contextmanager
def _located(location: str) -> Any:
    """Add the location of a figure's declaration to errors about the figure."""
    try:
        yield
    except InputError as error:
        where = location if error.where in ("", location) else f"{location} ({error.where})"
        raise InputError(error.what, where, error.hint) from None


def _made_before(folder: Path) -> dict[str, dict[str, object]]:
    try:
        made = json.loads((folder / MADE_FILE).read_bytes())
        return {str(name): one for name, one in made.items() if isinstance(one, dict)}
    except (OSError, ValueError, AttributeError, RecursionError):
        return {}  # then all figures are made


def _write_settings(content: Listing, names: Sequence[str], facts: Sequence[Facts], making: Making) -> None:
    rows = [("file", "command", "settings")]
    rows += [
        (name, figure.command(making.options), one.settings)
        for name, figure, one in zip(names, content.figures, facts, strict=True)
    ]
    write_whole(making.folder / words.SETTINGS, as_csv(rows).encode())


def given(options: RenderOptions) -> RenderOptions:
    """The options of a render, copied from an object with additional fields."""
    return RenderOptions(**{one.name: getattr(options, one.name) for one in fields(RenderOptions)})
