"""F_avg = 2 int_0^1 F(mu) mu dmu: the reflectance that light meets on average between the facets."""

from __future__ import annotations

from typing import Any

from ..optics import fresnel
from ..optics.fresnel.artist import edge_tint, imageworks

KINDS = {
    "exact": "the integral",
    "imageworks": "the polynomial fit of Kulla2017, p. 26, in reflectivity r and edge tint g (Gulbrandsen2014)",
}


def of_metal(base: Any, kind: str) -> Any:
    """F_avg of a conductor, its albedo not counted."""
    chosen = fresnel.kind(base.fresnel)
    if kind == "imageworks" and not chosen.white:
        return imageworks(*edge_tint(base.eta, base.k))
    return chosen.conductor_average(base.eta, base.k)


def of_glass(base: Any) -> Any:
    """F_avg of a dielectric from the side of its less dense medium, a float; eta may be below 1."""
    return fresnel.kind(base.fresnel).dielectric_average(base.eta)
