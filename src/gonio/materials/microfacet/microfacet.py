"""The base class of the microfacet materials: facts, sampling of normals, and D G divided by the cosines."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import BSDF, Delta, InnerAlbedo, Microsurface
from ...material.parameters import Angle, Colour, Member, Value, Width, angle, choice, pair_of, spectrum, width
from ...ops import Direction, Mask, Pair, Scalar, Spectrum, abs, backend, dot, function, ones_like, safe_div, where
from ...optics import frame, fresnel, masking
from ...optics.ndf import NDF, distribution
from ...optics.roughness import SMOOTH, widths

SAMPLINGS = {
    "visible": "normals that are visible from wo",
    "bounded": "visible normals that can reflect wo above the surface (GGX reflection only; otherwise as `visible`)",
    "normals": "all normals, with density D cos theta_m",
}


class Terms(NamedTuple):
    """The terms of a microfacet lobe, at the half vector of a pair of directions.

    D  density of microfacet normals, 1/sr
    G  masking and shadowing
    F  Fresnel reflectance, including the albedo
    """

    D: Scalar
    G: Scalar
    F: Spectrum


def alpha_width() -> Width:
    """Declare the width of the microfacet distribution."""
    return width(default=0.1, doc="width of the microfacet distribution; for anisotropy, widths along x and y")


def rotation_angle() -> Angle:
    """Declare the rotation of the axes of anisotropy."""
    return angle(default=0.0, doc="rotation of the anisotropy axes about the normal, measured from dp/du")


def ndf_choice() -> Member:
    """Declare the distribution of normals."""
    declared: Value = choice("ggx", "distribution of microfacet normals", NDF.family)
    return declared


def masking_choice() -> Member:
    """Declare the masking term."""
    declared: Value = choice("smith-correlated", "masking and shadowing", masking.Masking.family)
    return declared


def fresnel_choice() -> Member:
    """Declare the Fresnel reflectance."""
    declared: Value = choice("exact", "Fresnel reflectance", fresnel.Fresnel.family, white="one")
    return declared


def sampling_choice() -> str:
    """Declare the choice of the normals that are sampled."""
    return choice("visible", "which microfacet normals are sampled", SAMPLINGS)


def albedo_factor(doc: str) -> Colour:
    """Declare the scale factor for all scattered light, with a given documentation."""
    return spectrum(default=1.0, doc=doc, low=0.0, high=1.0, soft_high=True)


class _Microfacet(BSDF):
    """A rough surface whose facets reflect or refract like smooth interfaces: the base of conductor, metal and
    dielectric."""

    if TYPE_CHECKING:  # declared by each class, in the order of its constructor's arguments
        alpha: Width
        rotation: Angle
        ndf: Member
        masking: Member
        fresnel: Member
        albedo: Colour
        sampling: str

    def __post_init__(self) -> None:
        super().__post_init__()
        distribution(self.ndf).check_widths(self.alpha, f"{type(self).__name__}.alpha")

    @property
    def delta(self) -> Delta:
        return delta_of(self.plain.alpha)

    def _roughness(self) -> tuple[Pair, Mask]:
        """Widths of the distribution, and a mask of the rays for which the surface is smooth."""
        return widths(self.alpha)

    def _one(self) -> Scalar:
        """1 for every ray: the cosine along the normal."""
        return ones_like(self.alpha.x)

    @property
    def _turn(self) -> Pair | None:
        """The rotation of the axes of anisotropy, as an argument of `frame.rotate`."""
        return self.rotation

    @property
    def microsurface(self) -> Microsurface:
        kinds = self.ndf, self.masking, self.fresnel
        return Microsurface(*kinds, self.alpha, self.rotation, self._index(), self.albedo, self.transmits)

    def _index(self) -> Scalar | None:
        """Index inside divided by index outside, for a dielectric; None for a conductor."""
        return None

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The albedo of a smooth surface, the weight of its only sample; None for a rough surface."""
        if self.delta != "always":
            return None
        sin = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
        wo = frame.spherical_array(sin, mu, phi)
        drawn = self.sample(wo, np.full((len(mu), 3), 0.5), precision="float64")
        return np.asarray(drawn.weight, np.float64) * (mu > 0.0)[:, None]


def delta_of(alpha: object) -> Delta:
    """Whether user-given widths result in a delta lobe: alpha = 0 is a mirror."""
    pair = (alpha,) if backend.is_drjit(alpha) else pair_of(alpha)
    if any(backend.is_drjit(width) for width in pair):
        return "maybe"
    smooth = functools.reduce(np.maximum, (np.asarray(width, dtype=float) for width in pair)) < SMOOTH
    return "always" if np.all(smooth) else "maybe" if np.any(smooth) else "never"


@function
def upper(w: Direction) -> Direction:
    """w if it lies above the surface, else -w: the front of a facet, seen from -w, looks like its back, seen from w."""
    return where(w.z < 0.0, -w, w)


def _bounded(model: _Microfacet) -> bool:
    """Whether `sample_bounded` may be used. If the material transmits, it may not, because the facets that it excludes
    could still transmit."""
    return model.sampling == "bounded" and not model.transmits


@function
def sample_normal(model: _Microfacet, wo: Direction, u1: Scalar, u2: Scalar, alpha: Pair) -> Direction:
    """A normal (m.z > 0), sampled by the method that the model's `sampling` selects; if wo is below the surface, facets
    are seen from behind."""
    ndf = distribution(model.ndf)
    if model.sampling == "normals":
        return ndf.sample(u1, u2, alpha)
    if _bounded(model):
        return ndf.sample_bounded(upper(wo), u1, u2, alpha)
    return ndf.sample_visible(upper(wo), u1, u2, alpha)


@function
def pdf_per_cosine(model: _Microfacet, wo: Direction, m: Direction, alpha: Pair) -> Scalar:
    """Density of `sample_normal` divided by |o.m|, 1/sr; the cosine cancels in dm/dwi (Walter2007, eqs. 14 and 17)."""
    ndf = distribution(model.ndf)
    if model.sampling == "normals":
        return safe_div(ndf.pdf(m, alpha), abs(dot(wo, m)))
    if _bounded(model):
        return ndf.bounded_per_cosine(upper(wo), m, alpha)
    return ndf.visible_per_cosine(wo, m, alpha)


@function
def reflection(model: _Microfacet, wo: Direction, wi: Direction, m: Direction, alpha: Pair) -> Scalar:
    """D G / (4 |cos theta_o|): the microfacet BRDF without F, times |cos theta_i|."""
    ndf = distribution(model.ndf)
    g = masking.masking_shadowing(model.masking, ndf, wo, wi, m, alpha)
    return safe_div(g * ndf.D(m, alpha), 4.0 * abs(wo.z))
