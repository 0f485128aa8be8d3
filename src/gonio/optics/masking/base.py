"""The base class of all masking terms. A subclass must define `reflected`; everything else has a default."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...members import Family, instances_of
from ...ops import Direction, Pair, Scalar, dot, function, where
from ..ndf import NDF, distribution
from ..part import Part


class Masking(Part):
    """Masking and shadowing G of a pair of directions, for a distribution of normals and its widths.

    The first line of a subclass's docstring is its title in the manual.

    smith  whether G follows from the distribution of slopes, as Smith's G does; if not, it falls off as slowly as a
           rational function of the cosine. The axes of energy-compensation tables depend on this property
    """

    name: ClassVar[str] = ""
    family: ClassVar[Family[Masking]]
    smith: ClassVar[bool] = True
    formulas: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "reflected": ("ndf", "vec3", "vec3", "vec3", "vec2", "float"),
        "transmitted": ("ndf", "vec3", "vec3", "vec3", "vec2", "float"),
    }

    def missing(self) -> str:
        return "" if type(self).reflected is not Masking.reflected else "reflected(self, ndf, wo, wi, m, alpha)"

    def _given(self, kind: str) -> object:
        return distribution("ggx")

    def reflected(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G for two directions on the same side of the surface; m is the normal of the facet that reflects one into the
        other."""
        raise self.lacks("no `reflected`", "reflected(self, ndf, wo, wi, m, alpha)")

    def transmitted(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G for two directions on opposite sides; m is the normal of the facet that refracts one into the other. The
        default returns the value of `reflected`."""
        return self.reflected(ndf, wo, wi, m, alpha)

    def onset(self, alpha: Scalar) -> Scalar:
        """The cosine below which masking is strong, for an isotropic width; alpha for Smith's terms."""
        return alpha


Masking.family = Family("masking term", "gonio.maskings", (__package__,), instances_of(Masking), "masking")


def term(name: str) -> Masking:
    """The masking term of this name. Raises InputError if there is none."""
    return Masking.family.get(name)


@function
def masking_shadowing(
    kind: str, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair, transmits: bool = False
) -> Scalar:
    """Masking and shadowing G by the term of a given name; 0 if wo or wi lies behind the facet.

    kind       name of the masking term
    m          normal of the facet, m.z > 0
    transmits  whether wi and wo lie on opposite sides of the surface
    """
    chosen = term(kind)
    g = (chosen.transmitted if transmits else chosen.reflected)(ndf, wo, wi, m, alpha)
    # v.m and v.n must have the same sign, or the facet would be seen through the surface
    visible = (dot(wo, m) * wo.z > 0.0) & (dot(wi, m) * wi.z > 0.0)
    return where(visible, g, 0.0)
