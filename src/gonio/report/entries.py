"""The kinds of figures of a report. Each figure is created by the code of the verb of the same name, as a file in the
folder `figures`."""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from ..catalog import notation, operands
from ..catalog.operands import Kind
from ..check import Report as Submissions
from ..check import check
from ..errors import InputError
from ..pictures import exposures
from ..render import tables
from ..render.finish import Result, render_to_file
from ..render.options import RenderOptions
from ..render.prepare import Prepared, prepare
from ..render.request import Request, parse_size
from ..scene.values import Number, Part, Whole
from ..viewer import contact_sheet, plots
from ..work import facts, parts

Words = Annotated[str, Field(min_length=1)]


@dataclass(frozen=True)
class Making:
    """Options and folder for the creation of figures.

    options  options of all pictures, from the command line; those that differ from their defaults override the list
    folder   the folder of the figures
    tell     called with notices about results of an earlier run
    """

    options: RenderOptions
    folder: Path
    tell: Callable[[str], None]


@dataclass(frozen=True)
class Facts:
    """The settings of a figure, for the table at the end of the report, and warnings for the terminal."""

    settings: str
    warnings: tuple[str, ...] = ()


class PictureKeys(Part):
    """Options of one picture or of all pictures: those options of `gonio render` that affect the picture."""

    spp: Whole | None = Field(default=None, ge=1)
    size: str | None = None
    integrator: str | None = None
    max_depth: Whole | None = Field(default=None, alias="max-depth", ge=1)
    sampler: str | None = None
    seed: Whole | None = Field(default=None, ge=0)
    spectral: bool | None = None
    denoise: bool | None = None
    exposure: Number | Literal["auto"] | None = None

    def request(self, given: RenderOptions) -> dict[str, Any]:
        """The options as arguments of a Request. Options given on the command line take precedence."""
        options = {one.name: getattr(given, one.name) for one in fields(RenderOptions)}
        for one in fields(RenderOptions):
            own = getattr(self, one.name, None)
            if own is not None and options[one.name] == one.default:
                options[one.name] = parse_size(own) if one.name == "size" else own
        exposures.check(options["exposure"])
        return options


class Figure(Part):
    """A figure. `heading`, `caption` and `text` are copied to a new report.md, where they are edited later.

    name  the name of the figure's file, without suffix
    """

    suffix: ClassVar[str] = ".png"
    type: str
    name: str = Field(default="", pattern=r"^([A-Za-z0-9][A-Za-z0-9_.-]*)?$")
    heading: str = ""
    caption: str = ""
    text: str = ""

    def with_defaults(self, common: PictureKeys, scene: str) -> Figure:
        """The figure, with the list's options and scene in place of missing ones."""
        return self

    def title(self) -> str:
        """The heading that is used if none is given."""
        raise NotImplementedError

    def description(self) -> str:
        """The caption that is used if none is given."""
        raise NotImplementedError

    def command(self, given: RenderOptions) -> str:
        """The command that creates only this figure.

        given  options of all pictures
        """
        raise NotImplementedError

    def identity(self, making: Making) -> str:
        """Check all inputs that can be checked before rendering. Returns a hash of everything that the figure depends
        on, or "" for a figure that takes only seconds and is created in every run. Raises InputError for a figure that
        cannot be created."""
        raise NotImplementedError

    def make(self, making: Making, file: Path) -> Facts:
        """Write the figure to a file."""
        raise NotImplementedError


class SceneFigure(Figure, PictureKeys):
    """A figure of a scene, or of a material on a ball."""

    scene: str = ""

    def with_defaults(self, common: PictureKeys, scene: str) -> Figure:
        missing = {name: getattr(common, name) for name in PictureKeys.model_fields if getattr(self, name) is None}
        return self.model_copy(update={**missing, "scene": self.scene or scene})

    def _shown(self, making: Making) -> tuple[Request, notation.Settings | None]:
        """The request, without a material, and the settings of the material; None for a scene."""
        if not self.scene:
            raise InputError("no scene", "scene", "name a scene's folder, or a material")
        kind = operands.kind_of(self.scene, {Kind.SCENE, *operands.MATERIALS}, "scene")
        named = None if kind is Kind.SCENE else notation.taken_apart(self.scene, "scene", making.options.allow_code)
        return Request(Path(named[0].name if named else self.scene), **self.request(making.options)), named

    def _scene_name(self) -> str:
        path = Path(self.scene)
        return path.resolve().name if path.exists() else self.scene

    def _command(self, given: RenderOptions, *more: str) -> str:
        options = self.request(given)
        words = ["gonio", self.type, self.scene, *more]
        for one in fields(RenderOptions):
            value = options[one.name]
            if one.name in PictureKeys.model_fields and value != one.default:
                words.append(f"--{one.name.replace('_', '-')}")
                words += [] if value is True else ["x".join(map(str, value)) if one.name == "size" else str(value)]
        return shlex.join(words)


class Render(SceneFigure):
    """A picture of the scene."""

    type: Literal["render"]

    def title(self) -> str:
        return f"The scene {self._scene_name()}"

    def description(self) -> str:
        return f"The scene {self._scene_name()}."

    def command(self, given: RenderOptions) -> str:
        return self._command(given)

    def identity(self, making: Making) -> str:
        return _identity(prepare(self._request(making)))

    def make(self, making: Making, file: Path) -> Facts:
        request = self._request(making, file)
        result = render_to_file(request, tell=making.tell)
        if result.stopped:
            raise KeyboardInterrupt
        return Facts(_settings(result), result.warnings)

    def _request(self, making: Making, file: Path | None = None) -> Request:
        request, named = self._shown(making)
        material = None if named is None else notation.build(named)
        return Request(**{**vars(request), "material": material, "output": file})


class Study(SceneFigure):
    """A contact sheet of pictures for several values, as created by `gonio study`."""

    type: Literal["study"]
    vary: Annotated[list[Words], Field(min_length=1)]

    def title(self) -> str:
        return f"{self._scene_name()}: {' and '.join(one.name for one in self._variations())}"

    def description(self) -> str:
        names = [one.name for one in self._variations()]
        across = f" from top to bottom, {names[1]} from left to right" if len(names) > 1 else ""
        return f"{self._scene_name()} for several values of {names[0]}{across}."

    def command(self, given: RenderOptions) -> str:
        return self._command(given, *(word for text in self.vary for word in ("--vary", text)))

    def identity(self, making: Making) -> str:
        request, named = self._shown(making)
        cells = contact_sheet.cells_of(self._variations())
        pictures = [_identity(prepare(contact_sheet.with_cell(request, cell, named))) for cell in cells]
        return parts.key_of(self.vary, *pictures)

    def make(self, making: Making, file: Path) -> Facts:
        request, named = self._shown(making)
        sheet = contact_sheet.render_sheet(request, self._variations(), file, "", named, tell=making.tell)
        width, height = sheet.size
        return Facts(f"{len(sheet.cells)} pictures, {width} x {height}, {sheet.spp} spp", sheet.warnings)

    def _variations(self) -> list[contact_sheet.Variation]:
        return [contact_sheet.parse_variation(text) for text in self.vary]


class Plot(Figure):
    """A plot of materials, as created by `gonio plot`."""

    type: Literal["plot"]
    model: Annotated[list[Words], Field(min_length=1)]
    kind: Literal["lobe", "slice", "albedo", "image"] = "lobe"
    angles: list[Number] | None = None

    def title(self) -> str:
        return f"{', '.join(self.model)}: {self.kind}"

    def description(self) -> str:
        subject = {
            "lobe": "Polar plots of the lobes of", "slice": "Slices through the lobes of", "albedo": "Albedo of",
            "image": "Image slices of",
        }[self.kind]  # fmt: skip
        return f"{subject} {', '.join(self.model)}."

    def command(self, given: RenderOptions) -> str:
        angles = [] if self.angles is None else ["--angles", ",".join(f"{angle:g}" for angle in self.angles)]
        return shlex.join(["gonio", "plot", *self.model, "--kind", self.kind, *angles])

    def identity(self, making: Making) -> str:
        if self.model == ["fresnel"]:
            return _of_formulas(self.kind)
        kinds = [operands.kind_of(text, {Kind.TABLES, *operands.MATERIALS}, "model") for text in self.model]
        for text, kind in zip(self.model, kinds, strict=True):
            if kind is not Kind.TABLES:
                notation.named(text, allow_code=making.options.allow_code)
        return _of_formulas(self.model, self.kind, self.angles) if set(kinds) == {Kind.NAME} else ""

    def make(self, making: Making, file: Path) -> Facts:
        plots.plot(*self.model, kind=self.kind, angles=self.angles, output=file)
        return Facts("")


class Bake(Figure):
    """A figure of albedo tables, as created by `gonio bake`. A folder next to the figure contains the tables."""

    type: Literal["bake"]
    target: Words = "ggx"
    lut: list[Literal["E", "Eavg", "dfg", "glass"]] | None = None
    resolution: Whole = Field(default=128, ge=1, le=4096)
    method: Words = "quadrature"
    masking: str | None = None
    samples: Whole = Field(default=1024, ge=1)
    layout: Literal["linear", "stretched"] = "linear"

    def title(self) -> str:
        return f"Tables of {self.target}"

    def description(self) -> str:
        return f"Directional albedo E and its average for {self.target}, by {self.method}."

    def command(self, given: RenderOptions) -> str:
        own = {"method": self.method, "masking": self.masking, "resolution": self.resolution, "layout": self.layout}
        own |= {"samples": self.samples, "lut": ",".join(self.lut) if self.lut else None}
        defaults = {name: field.default for name, field in type(self).model_fields.items()}
        words = [word for name, value in own.items() if value != defaults[name] for word in (f"--{name}", str(value))]
        return shlex.join(["gonio", "bake", self.target, *words])

    def identity(self, making: Making) -> str:
        kind = operands.kind_of(self.target, tables.BAKED - {Kind.PICTURE}, "target")
        return _of_formulas(self.command(making.options)) if kind in (Kind.NAME, Kind.DISTRIBUTION) else ""

    def make(self, making: Making, file: Path) -> Facts:
        folder = file.with_suffix("")
        baked = tables.bake(
            self.target, folder, lut=self.lut, resolution=self.resolution, method=self.method, masking=self.masking,
            samples=self.samples, layout=self.layout,
        )  # fmt: skip
        plots.plot(folder, output=file)
        return Facts(f"{baked.manifest['size']} texels along each axis")


class Check(Figure):
    """A table of verdicts on the student's own work, as given by `gonio check`."""

    suffix: ClassVar[str] = ".csv"
    type: Literal["check"]
    work: Words
    against: str = ""
    picture_of: str = Field(default="", alias="picture-of")
    """The scene that a picture shows: `--scene` of `gonio check`."""
    up: Literal["z", "y", "x"] = "z"
    sheet: str | None = None

    def title(self) -> str:
        return f"Check of {Path(self.work).name}"

    def description(self) -> str:
        return f"Verdict of gonio check on {Path(self.work).name}."

    def command(self, given: RenderOptions) -> str:
        words = [self.work, *([self.against] if self.against else [])]
        words += ["--scene", self.picture_of] if self.picture_of else []
        words += ["--up", self.up] if self.up != "z" else []
        return shlex.join(["gonio", "check", *words, *(["--sheet", self.sheet] if self.sheet else [])])

    def identity(self, making: Making) -> str:
        if not (Path(self.work).exists() or ":" in self.work):
            raise InputError(f"no file '{self.work}'", "work", "check the path")
        return ""

    def make(self, making: Making, file: Path) -> Facts:
        result = check(
            self.work,
            self.against or None,
            scene=self.picture_of or None,
            up=self.up,
            sheet=self.sheet,
            allow_outside=making.options.allow_outside,
            allow_code=making.options.allow_code,
        )
        rows: list[tuple[str, ...]]
        if isinstance(result, Submissions):
            rows = [("submission", "task", "file", "verdict", "points", "probable mistake"), *result.rows()]
        else:
            rows = [("work", "verdict", "probable mistake", "details")]
            rows.append((result.name, result.status, result.cause, "; ".join(result.facts)))
        file.write_text(as_csv(rows), encoding="utf-8")
        return Facts("")


def as_csv(rows: Iterable[Sequence[str]]) -> str:
    """Rows as the text of a .csv file."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def _identity(prepared: Prepared) -> str:
    request = prepared.request
    how = (prepared.spp, prepared.size, request.denoise, request.exposure)
    return parts.key_of(sorted(prepared.sources.identity().items()), *how)


def _of_formulas(*what: object) -> str:
    """The identity of a figure that depends only on Gonio's formulas; "" if it may depend on a file."""
    named_files = any("file=" in str(one) or "/" in str(one) for one in what)
    return "" if named_files else parts.key_of(what, facts.versions(), facts.code())


def _settings(result: Result) -> str:
    width, height = result.size
    return f"{width} x {height}, {result.spp} spp, {result.settings['integrator']}"
