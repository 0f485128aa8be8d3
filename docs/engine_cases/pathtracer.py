"""three-gpu-pathtracer: furnaces, the symmetry of each lobe, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, asymmetry, furnace, material

INTRO = """The BSDF of the WebGL path tracer: `bsdfResult` for f and its density, `bsdfSample` for directions, of an
opaque surface without maps at the first hit of a path. Random numbers come from the law. Transmission and fog are not
judged."""

LOBES = {
    "metal": {},
    "dielectric": {"metalness": 0.0},
    "smooth": {"metalness": 0.0, "roughness": 0.0},
    "coat": {"clearcoat": 1.0},
    "sheen": {"sheen": 1.0},
}


def trials(folder: Path) -> dict[str, float]:
    """The asymmetry of f with one lobe at a time, and the albedo of the sheen."""
    figures = {name: asymmetry(material(folder, "pathtracer", **settings)) for name, settings in LOBES.items()}
    sheen = material(folder, "pathtracer", color=0.0, metalness=1.0, sheen=1.0, sheenRoughness=0.5)
    figures["sheen_grazing"], figures["sheen_normal"] = furnace(sheen, (0.05, 1.0))
    # the sheen term of one pair of directions in both orders, over the cosine of the light
    low, high = (np.array([[np.sqrt(1.0 - z * z), 0.0, z]]) for z in (0.2, 0.8))
    bare = material(folder, "pathtracer", color=0.0, metalness=1.0)
    there, back = (
        float((sheen.eval(*pair, precision="float64") - bare.eval(*pair, precision="float64"))[0, 0])
        for pair in ((low, high), (high, low))
    )
    return figures | {"sheen_there": there, "sheen_back": back}


CAUSES = {
    ("pathtracer", "positivity"): "NaN where the light lies in the view's direction: `dielectricFresnel` takes the "
    "square root of 1 - cos^2, and dot(wo, wh) may exceed 1 by a rounding. Remedy: clamp the cosine, or max(0, ...) "
    "under the root.",
    ("pathtracer", "weight"): "unexplained; it is of the size of roundings in 64 bits, at roughness 0 alone.",
    ("pathtracer", "pdf"): "`ggxDistribution` raises alpha^2 to 1e-6, while `ggxDirection` draws normals with the "
    "alpha given: below roughness 0.03 the density is wider than the samples.",
    ("pathtracer", "reciprocity"): "Two terms. `sheenColor` lacks the cosine of the light, which `diffuseEval` and "
    "`specularEval` include: for cosines of 0.2 and 0.8 the sheen adds {sheen_there:.4f} and, exchanged, "
    "{sheen_back:.4f}, where a ratio of 4 is meant. In `diffuseEval` the retroreflection `rr` grows by the squared "
    "Schlick weight of the light, `fl`, where Burley has the squared cosine of the half angle, which is the same for "
    "both directions. With one lobe at a time f(wo, wi) and f(wi, wo) differ by at most {metal:.0e} of their value for "
    "metal, {coat:.0e} with clear coat, {dielectric:.2f} for a dielectric of roughness 0.5 ({smooth:.0e} at "
    "roughness 0, where the term vanishes) and {sheen:.2f} with sheen.",
    (
        "pathtracer",
        "energy",
    ): "At color 0 and roughness 0 the density is wider than the samples (see *pdf*), so that a few samples hold much "
    "of the light. At other values light is gained by gloss over a white base: `specularEval` reflects "
    "by Schlick's formula up to 1 at grazing "
    "angles, while `diffuseEval` keeps 1 - F of the exact Fresnel equations, at the half vector of each light. With "
    "sheen the missing cosine adds light as well (see *reciprocity*).",
    ("pathtracer", "precision"): "`ggxShadowMaskG1` takes the tangent of the arc cosine of wo.z, which loses digits "
    "beyond 89.9 degrees; tan^2 = (1 - z^2) / z^2 needs neither function. The size is invisible.",
}


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The sheen's cosine."""
    last = list(figures.values())[-1]
    grazing, normal = last["sheen_grazing"], last["sheen_normal"]
    return f"""## The cosine of the sheen

`bsdfEval` adds `sheenColor`, D G / (4 cos cos), to values that contain the light's cosine. Without it the albedo of a
white sheen of roughness 0.5 over a black metal is {grazing:.2f} at n.v 0.05 and {normal:.2f} at n.v 1.
Remedy: multiply by wi.z, as in `specularEval`."""


ENGINE = Engine(
    package="three-gpu-pathtracer",
    page="three-gpu-pathtracer",
    title="three-gpu-pathtracer",
    home="https://github.com/gkjohnson/three-gpu-pathtracer",
    intro=INTRO,
    materials=("pathtracer",),
    furnaces=(
        Furnace("White metal", "pathtracer", lambda r: {"roughness": r}),
        Furnace("White dielectric", "pathtracer", lambda r: {"roughness": r, "metalness": 0.0}),
        Furnace("White dielectric, white sheen of this roughness", "pathtracer",
                lambda r: {"roughness": 0.5, "metalness": 0.0, "sheen": 1.0, "sheenRoughness": r}),
    ),
    remarks={
        "White metal": "Single scattering without compensation, as in most path tracers; the loss is that of GGX.",
        "White dielectric": "See *energy* below.",
        "White dielectric, white sheen of this roughness": "See the cosine of the sheen.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
)  # fmt: skip
