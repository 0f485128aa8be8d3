"""What every masking term offers; a member must give `reflected`, all else has a default."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ...members import Family, instances_of
from ...ops import Direction, Pair, Scalar, dot, function, where
from ..ndf import NDF, distribution
from ..part import Part


class Masking(Part):
    """Masking and shadowing G of a pair of directions, made from a distribution of normals and its widths.

    The first line of a member's docstring is its title in the manual.

    smith  whether G follows from the distribution's slopes, as Smith's does; False: it sets in as slowly as a rational
           function of the cosine. Tables of what single scattering misses choose their axes by it
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
        """G of two directions on the same side of the surface, m the normal that mirrors one into the other."""
        raise self.lacks("no `reflected`", "reflected(self, ndf, wo, wi, m, alpha)")

    def transmitted(self, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
        """G of two directions on opposite sides, m the normal that refracts one into the other; here as `reflected`."""
        return self.reflected(ndf, wo, wi, m, alpha)

    def onset(self, alpha: Scalar) -> Scalar:
        """The cosine about which masking sets in, at an isotropic width; Smith's is alpha."""
        return alpha


Masking.family = Family("masking term", "gonio.maskings", (__package__,), instances_of(Masking), "masking")


def term(name: str) -> Masking:
    """The masking term of that name; InputError where there is none."""
    return Masking.family.get(name)


@function
def masking_shadowing(
    kind: str, ndf: NDF, wo: Direction, wi: Direction, m: Direction, alpha: Pair, transmits: bool = False
) -> Scalar:
    """Masking and shadowing G, by name; 0 where wo or wi sees the facet from its back.

    m          the facet's normal, m.z > 0
    transmits  wi lies on the other side of the surface than wo
    """
    chosen = term(kind)
    g = (chosen.transmitted if transmits else chosen.reflected)(ndf, wo, wi, m, alpha)
    # v.m and v.n must agree in sign, or the facet is seen through the surface
    visible = (dot(wo, m) * wo.z > 0.0) & (dot(wi, m) * wi.z > 0.0)
    return where(visible, g, 0.0)
