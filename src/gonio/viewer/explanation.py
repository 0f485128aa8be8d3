"""`gonio explain` and `go.explain`: the manual page of a material, of any other member of a family, or of a family."""

from __future__ import annotations

from dataclasses import dataclass

from ..catalog import operands
from ..catalog.material import MaterialLike, material
from ..owner import public
from . import families, manual


@dataclass(frozen=True)
class Explanation:
    """One page, or one page per member with the given name. `print` shows the text."""

    pages: tuple[manual.Page | families.MemberPage | families.FamilyPage, ...]

    def as_dict(self) -> dict[str, object]:
        """A dictionary for JSON: the first page, with the other pages under `also`."""
        first, *others = (page.as_dict() for page in self.pages)
        return {**first, "also": others} if others else first

    def text(self, width: int = families.WIDTH) -> str:
        """The text for a terminal with `width` columns."""
        return "\n\n".join(page.text(width) for page in self.pages)

    def __str__(self) -> str:
        return self.text()


@public
def explain(name: MaterialLike = "") -> Explanation:
    """The manual page of a material, or of any other member of a family: formula, parameters, limits, source.

        print(go.explain("conductor"))
        print(go.explain("ggx"))

    name  a material, in any form that `go.material` accepts; the name of a distribution of normals, a masking term, an
          integrator, a law, ...; or a family, such as "fresnel", whose members are listed; "" lists the families
    Raises InputError, with the closest known name, for an unknown name.
    """
    if not name:
        return Explanation((families.index(),))
    if not isinstance(name, str) or operands.is_material(name):
        return Explanation((manual.page(type(material(name))),))
    return Explanation(tuple(families.pages(name)))
