"""What the two microfacet materials share: how a width is read, which normals are sampled, D G over the cosines."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from ..ops import abs, backend, dot, function, maximum, safe_div, vec2, where
from ..optics import fresnel, masking
from ..optics.ndf import NDF, distribution

NDFS = NDF.family.titles()
MASKINGS = masking.Masking.family.titles()
FRESNELS = fresnel.Fresnel.family.titles()
SAMPLINGS = {
    "visible": "normals as wo sees them",
    "bounded": "visible normals whose reflection can lie above the surface (GGX; glass that transmits: as visible)",
    "normals": "all normals, by D cos",
}

# Below this width a facet's tilt, about alpha, is no more than a thousand roundings of a float32 direction (6e-8), and
# D's peak, 1 / (pi alpha^2), passes 3e7: the lobe can no longer be resolved and is taken as a mirror's.
SMOOTH = 1e-4


def widths(alpha: Any) -> tuple[Any, Any]:
    """(alpha held above `SMOOTH`, whether the surface is smooth)."""
    smooth = (alpha.x < SMOOTH) & (alpha.y < SMOOTH)
    return vec2(maximum(alpha.x, SMOOTH), maximum(alpha.y, SMOOTH)), smooth


def delta(alpha: Any) -> str:
    """Whether widths, as the user gave them, make a delta lobe: "never", "always" or "maybe"."""
    if backend.is_drjit(alpha):
        return "maybe"
    pair = alpha if isinstance(alpha, tuple | list) else (alpha,)
    if any(backend.is_drjit(width) for width in pair):
        return "maybe"
    smooth = functools.reduce(np.maximum, (np.asarray(width, dtype=float) for width in pair)) < SMOOTH
    return "always" if np.all(smooth) else "maybe" if np.any(smooth) else "never"


@function
def upper(w: Any) -> Any:
    """w above the surface, -w below: a facet seen from behind at -w looks as from the front at w."""
    return where(w.z < 0.0, -w, w)


class Terms(NamedTuple):
    """What a microfacet lobe is made of, at the half vector of a pair of directions.

    D  density of microfacet normals, 1/sr
    G  masking and shadowing
    F  Fresnel reflectance, with the albedo
    """

    D: Any
    G: Any
    F: Any


def _bounded(model: Any) -> bool:
    """Whether the bound on reflections may be used: a facet that it leaves out could still transmit."""
    return model.sampling == "bounded" and not model.transmits


@function
def sample_normal(model: Any, wo: Any, u1: Any, u2: Any, alpha: Any) -> Any:
    """A normal (m.z > 0) by the model's `sampling`; its back faces a wo below the surface."""
    ndf = distribution(model.ndf)
    if model.sampling == "normals":
        return ndf.sample(u1, u2, alpha)
    if _bounded(model):
        return ndf.sample_bounded(upper(wo), u1, u2, alpha)
    return ndf.sample_visible(upper(wo), u1, u2, alpha)


@function
def pdf_per_cosine(model: Any, wo: Any, m: Any, alpha: Any) -> Any:
    """Density of `sample_normal` over |o.m|, 1/sr: the cosine cancels in dm/dwi (Walter2007, eq. 14 and 17)."""
    ndf = distribution(model.ndf)
    if model.sampling == "normals":
        return safe_div(ndf.pdf(m, alpha), abs(dot(wo, m)))
    if _bounded(model):
        return ndf.bounded_per_cosine(upper(wo), m, alpha)
    return ndf.visible_per_cosine(wo, m, alpha)


@function
def reflection(model: Any, wo: Any, wi: Any, m: Any, alpha: Any) -> Any:
    """D G / (4 |cos theta_o|): the microfacet BRDF without F, times |cos theta_i|."""
    ndf = distribution(model.ndf)
    g = masking.masking_shadowing(model.masking, ndf, wo, wi, m, alpha)
    return safe_div(g * ndf.D(m, alpha), 4.0 * abs(wo.z))
