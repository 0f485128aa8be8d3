"""glTF-Sample-Viewer: white furnaces, the clamp of its anisotropic masking term, and causes."""

from __future__ import annotations

from pathlib import Path

from .base import Engine, Furnace, furnace, material

INTRO = """glTF-Sample-Viewer is the reference viewer for glTF. This card covers `BRDF_lambertian`, `BRDF_specularGGX`
and `BRDF_specularGGXAnisotropy`, blended by the Fresnel terms as in the shader's loop over lights. Sheen, clear coat,
iridescence, transmission and environment maps are not tested."""


def trials(folder: Path) -> dict[str, float]:
    """Albedos of narrow lobes with the isotropic term, and with the anisotropic term at strength 0."""
    figures = {}
    for rough in (0.25, 0.5):
        settings = {"rough": rough, "strength": 0.0}
        plain = furnace(material(folder, "gltf-standard", rough=rough), (0.05, 0.25, 1.0))
        clamped = furnace(material(folder, "gltf-anisotropic", **settings), (0.05, 0.25, 1.0))
        for name, cosine in enumerate(("005", "025", "1")):
            figures |= {f"plain_{rough:g}_{cosine}": plain[name], f"clamped_{rough:g}_{cosine}": clamped[name]}
    return figures


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The section on the clamp."""
    last = list(figures.values())[-1]
    rows = "\n".join(
        f"| {rough:g} | {cosine} | {last[f'plain_{rough:g}_{key}']:.3f} | {last[f'clamped_{rough:g}_{key}']:.3f} |"
        for rough in (0.25, 0.5)
        for key, cosine in (("005", "0.05"), ("025", "0.25"), ("1", "1"))
    )
    return f"""## The clamp of the anisotropic masking term

`V_GGX_anisotropic` ends in `clamp(v, 0.0, 1.0)`. V is G / (4 n.l n.v), which is 1/4 at normal incidence and exceeds 1
where n.l n.v < G / 4, that is, at grazing angles. The clamp loses energy there. `V_GGX` has no such clamp, but is
otherwise the same function if the anisotropy is 0. The table gives the albedo of white metal with anisotropy 0:

| roughness | n.v | `BRDF_specularGGX` | `BRDF_specularGGXAnisotropy` |
|---|---|---|---|
{rows}

Remedy: use `max(v, 0.0)`, or test for a positive denominator, as `V_GGX` does."""


CAUSES = {
    ("gltf-standard", "precision"): "Near the center of the lobe, `NdotH^2 (a2 - 1) + 1` in `D_GGX` loses digits to "
    "cancellation. Remedy: compute 1 - NdotH^2 as the squared length of cross(n, h), as in Filament.",
    ("gltf-standard", "energy"): "The specular lobe is added to a white base that is attenuated too little; see the "
    "white-furnace results for the white dielectric.",
    (
        "gltf-anisotropic",
        "positivity",
    ): "At roughness 0 and strength 0, both alphas of `D_GGX_anisotropic` are so small that a2 / dot(f, f) is 0 / 0. "
    "Remedy: impose a lower bound on `at`, the alpha along the tangent, as well.",
    ("gltf-standard", "positivity"): "At roughness 0, `D_GGX` divides 0 by 0 if h is the normal. Remedy: impose a "
    "lower bound on alpha.",
}

ENGINE = Engine(
    package="@khronosgroup/gltf-viewer",
    page="gltf-viewer",
    title="glTF-Sample-Viewer",
    home="https://github.com/KhronosGroup/glTF-Sample-Viewer",
    intro=INTRO,
    materials=("gltf-standard", "gltf-anisotropic"),
    furnaces=(
        Furnace("White metal", "gltf-standard", lambda r: {"rough": r}),
        Furnace("White dielectric", "gltf-standard", lambda r: {"rough": r, "metal": 0.0}),
        Furnace("White metal, anisotropy 0.7", "gltf-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
    ),
    remarks={
        "White metal": "The lobe models single scattering only, without compensation, as in the specification; the "
        "loss is that of single-scattering GGX.",
        "White dielectric": "The diffuse and specular lobes are blended with `mix`, using F at the half vector for "
        "each light, as in appendix B of the specification. At grazing view angles, v.h is large and F(v.h) is small "
        "for most light directions. The diffuse lobe therefore has nearly its full weight, although the albedo of the "
        "specular lobe is much larger than these values of F.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("gltf-viewer-furnace.html",),
)
