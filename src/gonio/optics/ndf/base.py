"""What every distribution of normals offers; a member must give D, Lambda and `sample`, all else has a default."""

from __future__ import annotations

from typing import Any, ClassVar

from ...members import Family, instances_of
from ...ops import abs, dot, maximum, safe_div


class NDF:
    """Distribution of microfacet normals with widths alpha = (alpha_x, alpha_y).

    All methods take unit vectors of the local frame. m lies above the surface (m.z > 0); a direction v may lie on
    either side, Smith's terms depend on |v.z|. The first line of a member's docstring is its title in the manual.

    long_tailed  whether Lambda falls off so slowly with the cosine, as 1 / cos^2, that something is masked at any angle
                 (GGX); False: a few alpha from grazing nothing is. Tables of what single scattering misses choose their
                 axes by it
    """

    name: ClassVar[str] = ""
    family: ClassVar[Family[NDF]]
    long_tailed: ClassVar[bool] = False

    def D(self, m: Any, alpha: Any) -> Any:
        """Density of normals, 1/sr: its integral over D(m) m.z is 1."""
        raise NotImplementedError

    def Lambda(self, v: Any, alpha: Any) -> Any:
        """Smith's Lambda, exact: masked over visible projected area (Heitz2014)."""
        raise NotImplementedError

    def G1(self, v: Any, alpha: Any) -> Any:
        """Smith's masking of one direction, 1 / (1 + Lambda)."""
        return 1.0 / (1.0 + self.Lambda(v, alpha))

    def G1_customary(self, v: Any, alpha: Any) -> Any:
        """G1 as `smith-separable` means it; the exact one unless the field customarily uses a fit."""
        return self.G1(v, alpha)

    def sample(self, u1: Any, u2: Any, alpha: Any) -> Any:
        """A normal with density D(m) m.z."""
        raise NotImplementedError

    def pdf(self, m: Any, alpha: Any) -> Any:
        """Density of `sample`, D(m) m.z."""
        return self.D(m, alpha) * maximum(m.z, 0.0)

    def sample_visible(self, v: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        """A normal as v (v.z >= 0) sees them; without a routine of its own, all normals instead."""
        return self.sample(u1, u2, alpha)

    def pdf_visible(self, v: Any, m: Any, alpha: Any) -> Any:
        """Density of `sample_visible`."""
        return abs(dot(v, m)) * self.visible_per_cosine(v, m, alpha)

    def visible_per_cosine(self, v: Any, m: Any, alpha: Any) -> Any:
        """`pdf_visible` over |v.m|: the cosine cancels in the density of what is mirrored at m (Walter2007, eq. 14)."""
        return safe_div(self.pdf(m, alpha), abs(dot(v, m)))

    def sample_bounded(self, v: Any, u1: Any, u2: Any, alpha: Any) -> Any:
        """A visible normal whose reflection is less likely to fall below the surface; else `sample_visible`."""
        return self.sample_visible(v, u1, u2, alpha)

    def pdf_bounded(self, v: Any, m: Any, alpha: Any) -> Any:
        """Density of `sample_bounded`."""
        return abs(dot(v, m)) * self.bounded_per_cosine(v, m, alpha)

    def bounded_per_cosine(self, v: Any, m: Any, alpha: Any) -> Any:
        """`pdf_bounded` over |v.m|."""
        return self.visible_per_cosine(v, m, alpha)


NDF.family = Family("microfacet distribution", "gonio.distributions", (__package__,), instances_of(NDF), "ndf")
