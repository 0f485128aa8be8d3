"""Masking and shadowing: the share G of facets seen from wo and lit from wi.

    smith-correlated       masking and shadowing share the facet's height: 1 / (1 + L(wo) + L(wi)) in reflection
                           (Heitz2014, eq. 99) and B(1 + L(wo), 1 + L(wi)) in transmission (Heitz2016)
    smith-separable        G1(wo) G1(wi) (Walter2007, eq. 23); Beckmann's G1 is its rational fit (course sheet, eq. 8)
    smith-separable-exact  the same with the exact Lambda for every distribution
    schlick-direct         Gs(v) = n.v / (n.v (1 - k) + k), k = (roughness + 1)^2 / 8 (Karis2013, analytic lights)
    schlick-ibl            the same with k = alpha / 2 (Karis2013, image-based lighting)

L is Smith's Lambda of the distribution; roughness = sqrt(alpha), for anisotropic alpha (alpha_x alpha_y)^(1/4).
"""

from __future__ import annotations

from typing import Any

from ..ops import abs, dot, function, sqr, sqrt, where
from .ndf import NDF
from .special import beta

KINDS = {
    "smith-correlated": "Smith with correlated heights (Heitz2014)",
    "smith-separable": "Smith G1 G1 (Walter2007); Beckmann by its rational fit",
    "smith-separable-exact": "Smith G1 G1 with the exact Lambda",
    "schlick-direct": "Schlick-Smith, k = (roughness + 1)^2 / 8 (Karis2013)",
    "schlick-ibl": "Schlick-Smith, k = alpha / 2 (Karis2013)",
}


@function
def schlick_g1(v: Any, k: Any) -> Any:
    """n.v / (n.v (1 - k) + k): Schlick's rational form of Smith's G1 (Schlick1994)."""
    c = abs(v.z)
    return c / (c * (1.0 - k) + k)


@function
def masking_shadowing(kind: str, ndf: NDF, wo: Any, wi: Any, m: Any, alpha: Any, transmits: bool = False) -> Any:
    """Masking and shadowing G, by name; 0 where wo or wi sees the facet from its back.

    m          the facet's normal, m.z > 0
    transmits  wi lies on the other side of the surface than wo
    """
    if kind == "smith-correlated":
        lambda_o, lambda_i = ndf.Lambda(wo, alpha), ndf.Lambda(wi, alpha)
        g = beta(1.0 + lambda_o, 1.0 + lambda_i) if transmits else 1.0 / (1.0 + lambda_o + lambda_i)
    elif kind == "smith-separable":
        g = ndf.G1_customary(wo, alpha) * ndf.G1_customary(wi, alpha)
    elif kind == "smith-separable-exact":
        g = ndf.G1(wo, alpha) * ndf.G1(wi, alpha)
    else:
        width = sqrt(alpha.x * alpha.y)
        k = sqr(sqrt(width) + 1.0) * 0.125 if kind == "schlick-direct" else 0.5 * width
        g = schlick_g1(wo, k) * schlick_g1(wi, k)
    # v.m and v.n must agree in sign, or the facet is seen through the surface
    seen = (dot(wo, m) * wo.z > 0.0) & (dot(wi, m) * wi.z > 0.0)
    return where(seen, g, 0.0)
