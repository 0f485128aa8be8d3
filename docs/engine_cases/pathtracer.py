"""three-gpu-pathtracer: white furnaces, the asymmetry of each lobe, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, asymmetry, furnace, material

INTRO = """This card covers the BSDF of the WebGL path tracer, for an opaque surface without texture maps at the first
hit of a path: `bsdfResult`, which gives f and the pdf, and `bsdfSample`, which samples directions. The test supplies
the random numbers. Transmission and fog are not tested."""

LOBES = {
    "metal": {},
    "dielectric": {"metalness": 0.0},
    "smooth": {"metalness": 0.0, "roughness": 0.0},
    "coat": {"clearcoat": 1.0},
    "sheen": {"sheen": 1.0},
}


def trials(folder: Path) -> dict[str, float]:
    """Asymmetry of f with one lobe at a time, and albedo of the sheen."""
    figures = {name: asymmetry(material(folder, "pathtracer", **settings)) for name, settings in LOBES.items()}
    sheen = material(folder, "pathtracer", color=0.0, metalness=1.0, sheen=1.0, sheenRoughness=0.5)
    figures["sheen_grazing"], figures["sheen_normal"] = furnace(sheen, (0.05, 1.0))
    # the sheen term for one pair of directions in both orders
    low, high = (np.array([[np.sqrt(1.0 - z * z), 0.0, z]]) for z in (0.2, 0.8))
    bare = material(folder, "pathtracer", color=0.0, metalness=1.0)
    there, back = (
        float((sheen.eval(*pair, precision="float64") - bare.eval(*pair, precision="float64"))[0, 0])
        for pair in ((low, high), (high, low))
    )
    return figures | {"sheen_there": there, "sheen_back": back}


CAUSES = {
    ("pathtracer", "positivity"): "The result is NaN if the light and view directions coincide: `dielectricFresnel` "
    "takes the square root of 1 - cos^2, and dot(wo, wh) may exceed 1 because of rounding. Remedy: clamp the cosine, "
    "or use max(0, ...) under the square root.",
    (
        "pathtracer",
        "weight",
    ): "unknown; the error has the size of float64 rounding errors, and only roughness 0 is affected.",
    ("pathtracer", "pdf"): "`ggxDistribution` clamps alpha^2 to at least 1e-6, whereas `ggxDirection` samples normals "
    "with the given alpha: below roughness 0.03, the pdf is wider than the distribution of the samples.",
    ("pathtracer", "reciprocity"): "Two terms are responsible. `sheenColor` lacks the cosine of the light direction, "
    "which `diffuseEval` and `specularEval` include: for directions with cosines of 0.2 and 0.8, the sheen adds "
    "{sheen_there:.4f} and, if the directions are exchanged, {sheen_back:.4f}; the ratio should be 4. In "
    "`diffuseEval`, the retroreflection term `rr` grows with the squared Schlick weight of the light direction, `fl`, "
    "whereas Burley uses the squared cosine of the half angle, which is the same for both directions. If each lobe is "
    "tested by itself, the largest relative difference between f(wo, wi) and f(wi, wo) is {metal:.0e} for metal, "
    "{coat:.0e} with clear coat, {dielectric:.2f} for a dielectric of roughness 0.5 ({smooth:.0e} at roughness 0, "
    "where the term vanishes) and {sheen:.2f} with sheen.",
    (
        "pathtracer",
        "energy",
    ): "At color 0 and roughness 0, the pdf is wider than the distribution of the samples (see *pdf*), and a few "
    "samples carry much of the light. At other values, energy is gained because the specular lobe is added to a white "
    "base that is attenuated too little: `specularEval` uses Schlick's approximation, which approaches 1 at grazing "
    "angles, whereas `diffuseEval` is weighted by 1 - F of the exact Fresnel equations at the half vector of each "
    "light. With sheen, the missing cosine adds light as well (see *reciprocity*).",
    ("pathtracer", "precision"): "`ggxShadowMaskG1` computes the tangent of the arc cosine of wo.z, which is "
    "inaccurate beyond 89.9 degrees; tan^2 = (1 - z^2) / z^2 needs neither function. An error of this size is "
    "invisible.",
}


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The section on the cosine of the sheen."""
    last = list(figures.values())[-1]
    grazing, normal = last["sheen_grazing"], last["sheen_normal"]
    return f"""## The cosine of the sheen

`bsdfEval` adds `sheenColor`, D G / (4 cos cos), to values that include the cosine of the light direction. Because the
sheen lacks this cosine, the albedo of white sheen of roughness 0.5 over black metal is {grazing:.2f} at n.v 0.05 and
{normal:.2f} at n.v 1.
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
                lambda r: {"roughness": 0.5, "metalness": 0.0, "sheen": 1.0, "sheenRoughness": r},
                "White dielectric with white sheen; roughness of the sheen varies"),
    ),
    remarks={
        "White metal": "As in most path tracers, the lobe models single scattering only, without compensation; the "
        "loss is that of single-scattering GGX.",
        "White dielectric": "See *energy* below.",
        "White dielectric, white sheen of this roughness": "See [the cosine of the sheen]"
        "(#the-cosine-of-the-sheen).",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
)  # fmt: skip
