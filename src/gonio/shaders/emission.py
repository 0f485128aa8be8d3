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
    """The parts of a material that are written; the fields are arguments of `emit`."""

    functions: str | Sequence[str]
    own: OwnValues = field(default_factory=OwnValues)
    fit: str = ""
    ibl: bool = False
    budget: int = 0

    @property
    def approximates(self) -> bool:
        return bool(self.fit or self.ibl or self.budget)

    def check(self, count: int) -> None:
        """Raise InputError for options that exclude each other, and for more than one material."""
        if count != 1 or (self.fit and (self.ibl or self.budget)):
            what = f"{count} materials given" if count != 1 else "--fit with --ibl or --budget"
            raise InputError(
                what, "emit", "give one material and one of --fit, --ibl and --budget; --ibl also accepts --budget"
            )
        if self.own != OwnValues() and (self.fit or self.ibl):
            given = "--lean" if self.own.lean else "--constants" if self.own.constants else "--fold"
            what = f"{given} given with {'--fit' if self.fit else '--ibl'}"
            raise InputError(what, "emit", "it applies only to whole materials")


class EmitKeywords(OwnKeywords, PlacementKeywords, total=False):
    """The types of the additional keywords of `emit`."""


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
    """Write a material as shader code: eval, pdf, sample and the functions that they need.

        print(go.emit(go.Conductor.preset("Au", alpha=0.2), "glsl"))

    model          anything that `go.material` accepts, such as "conductor(preset=Au)"; a list yields one module with
                   all materials, in which common functions are declared once
    lang           name of a language, such as "glsl"; `gonio.shaders.languages()` lists all of them
    functions      a choice of "eval", "pdf", "sample", "terms" (D, G, F, ..., if the model has them)
    lean           omit code that the material's own values switch off, such as a coat of weight 0; such a weight is
                   then not a field. For the default `openpbr`, an eighth of the text remains
    constants      also write the material's own values, as a constant of the struct type: Conductor_values
    fold           write the material's own values into the code: expressions that depend on them alone become numbers;
                   the functions still have the struct as an argument but do not read it
    prefix         prefix of all global names, so that separately written shaders can be combined in one module
    group          binding group of the tables: WGSL's @group, HLSL's register space
    first_binding  binding number of the first table
    tables         format of the table files to which the text refers: "raw", "exr" or "ktx2"; see `Placement`
    half           write tables with 16 bits per number; the text states the measured error of 16-bit tables and
                   parameters
    fit            write only the albedos, as rational fits of this order, "N" or "N/M"; "N/0" yields polynomials
    ibl            write only the split sum of image-based lighting
    budget         use the most accurate terms, table or fit within this number of operations; 0 means no limit
    Numeric parameters become the fields of a struct; choices determine the code. Spectra are RGB, and values are those
    of the mode "radiance". Directions are unit vectors in the local frame, in which +z is the shading normal.
    Raises InputError for a stochastic material (RandomWalk), which has no shader code, and if `fit`, `ibl` and `budget`
    exclude each other.
    """
    names = {one.name for one in fields(OwnValues)}
    own: dict[str, Any] = {name: value for name, value in more.items() if name in names}
    place: dict[str, Any] = {name: value for name, value in more.items() if name not in names}
    return shader(model, lang, Choice(functions, OwnValues(**own), fit, ibl, budget), Placement(**place))[0].text


def shader(
    models: MaterialLike | Sequence[MaterialLike], lang: str, choice: Choice, placement: Placement
) -> tuple[Bundle, list[str]]:
    """The shader, and lines that state the measured errors of an approximation; the arguments are those of `emit`."""
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
