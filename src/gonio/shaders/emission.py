"""`go.emit`: a material as shader code, exact or approximated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Unpack

from ..arguments import takes_fields
from ..catalog.material import MaterialLike, material
from ..errors import InputError
from ..owner import public
from . import curves, tiers
from .bundle import Bundle, bundle
from .half import bounded
from .languages import Language
from .own_values import OwnKeywords, OwnValues
from .placement import Placement, PlacementKeywords


@dataclass(frozen=True)
class Choice:
    """The parts of a material to write; the fields are arguments of `emit`."""

    functions: str | Sequence[str]
    own: OwnValues = field(default_factory=OwnValues)
    fit: str = ""
    ibl: bool = False
    budget: int = 0

    @property
    def approximates(self) -> bool:
        return bool(self.fit or self.ibl or self.budget)

    def check(self, count: int) -> None:
        """Raise InputError for options that exclude each other, or more than one material."""
        if count != 1 or (self.fit and (self.ibl or self.budget)):
            what = f"{count} materials given" if count != 1 else "--fit with --ibl or --budget"
            raise InputError(
                what, "emit", "give one material and one of --fit, --ibl and --budget; --ibl also takes --budget"
            )
        if self.own != OwnValues() and (self.fit or self.ibl):
            given = "--lean" if self.own.lean else "--constants" if self.own.constants else "--fold"
            what = f"{given} given with {'--fit' if self.fit else '--ibl'}"
            raise InputError(what, "emit", "it applies only to whole materials")


class EmitKeywords(OwnKeywords, PlacementKeywords, total=False):
    """The types of further keywords of `emit`."""


@public
@takes_fields((OwnValues, Placement), EmitKeywords)
def emit(
    model: MaterialLike | Sequence[MaterialLike],
    lang: str = "glsl",
    functions: str | Sequence[str] = ("eval", "pdf", "sample"),
    *,
    fit: str = "",
    ibl: bool = False,
    budget: int = 0,
    **more: Unpack[EmitKeywords],
) -> str:
    """A material as shader code: eval, pdf, sample and the functions that they need.

        print(go.emit(go.Conductor.preset("Au", alpha=0.2), "glsl"))

    model          anything that `go.material` takes, such as "conductor(preset=Au)"; a list for one module with all of
                   them, in which common functions are declared once
    lang           name of a language, such as "glsl"; `gonio.shaders.languages()` lists all of them
    functions      a choice of "eval", "pdf", "sample", "terms" (D, G, F, ..., if the model has them)
    lean           omit code that the material's own values switch off, such as a coat of weight 0; such a weight is
                   then not a field. An eighth of the text of a default `openpbr` remains
    constants      also write the material's own values, as a constant of its struct: Conductor_values
    fold           write the material's own values into the code: expressions of them alone become numbers, and the
                   functions keep the struct as an argument but do not read it
    prefix         start of all global names, so that separately written shaders fit into one module
    group          binding group of the tables: WGSL's @group, HLSL's register space
    first_binding  binding number of the first table
    tables         format of the table files that the text names: "raw", "exr" or "ktx2"; see `Placement`
    half           write tables with 16 bits per number; the text states the measured error of 16-bit tables and
                   parameters
    fit            write the albedos instead, as rational fits of this order, "N" or "N/M"; "N/0" are polynomials
    ibl            write the split sum of image-based lighting instead
    budget         use the most accurate terms, table or fit within this number of operations; 0: no limit
    Numeric parameters become the fields of a struct; choices shape the code. Spectra are RGB, and values are those of
    "radiance" mode. Directions are unit vectors of the local frame, +z the shading normal.
    Raises InputError for a stochastic material (RandomWalk), which has no shader code, and where `fit`, `ibl` and
    `budget` exclude each other.
    """
    names = {one.name for one in fields(OwnValues)}
    own: dict[str, Any] = {name: value for name, value in more.items() if name in names}
    place: dict[str, Any] = {name: value for name, value in more.items() if name not in names}
    return shader(model, lang, Choice(functions, OwnValues(**own), fit, ibl, budget), Placement(**place))[0].text


def shader(
    models: MaterialLike | Sequence[MaterialLike], lang: str, choice: Choice, placement: Placement
) -> tuple[Bundle, list[str]]:
    """The shader, and lines that state the measured errors of an approximation; arguments as in `emit`."""
    lines: list[str] = []
    several = list(models) if isinstance(models, Sequence) and not isinstance(models, str) else [models]
    if placement.half and (choice.fit or choice.ibl or Language.family.get(str(lang)).standalone):
        raise InputError("half precision requested", "emit: half", "it needs a whole material in a shader language")
    if choice.approximates:
        choice.check(len(several))
        model = material(several[0])
        if choice.fit:
            return curves.fitted(model, choice.fit, lang, placement)
        if choice.ibl:
            made, chosen = tiers.split_sum(model, lang, placement, choice.budget)
            return made, [str(tier) for tier in chosen]
        cheapest, chosen = tiers.cheapest(model, choice.budget)
        several = [cheapest]
        lines = [str(tier) for tier in chosen]
    members = [material(one) for one in several]
    made = bundle(members, lang, choice.functions, placement=placement, **asdict(choice.own))
    if placement.half:
        made = bounded(made, members)
    return made, lines
