"""Godot: white furnaces, its two masking terms, its clear coat, and causes."""

from __future__ import annotations

from pathlib import Path

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 0.05), (0.25, 0.25), (0.5, 0.25), (0.5, 1.0), (0.75, 0.5), (1.0, 0.5))

INTRO = """This card covers `light_compute` of the clustered forward renderer, with one directional light and the
settings of `StandardMaterial3D`: Burley's diffuse lobe and GGX, with clear coat and anisotropy. Environment maps, rim,
backlight and transmittance are not tested. Unlike the renderer, this test does not round roughness and metallic to 8
bits. Later releases multiply the lobe by an energy-compensation factor, which was not tested."""


def trials(folder: Path) -> dict[str, float]:
    """Albedo of white metal with both masking terms, its exact value, and albedos with and without a coat."""
    figures = {}
    for rough, cosine in PLACES:
        key = f"{rough:g}_{cosine:g}"
        plain = material(folder, "godot-standard", rough=rough)
        long = material(folder, "godot-anisotropic", rough=rough, strength=0.0)
        figures |= {
            f"exact_{key}": single_scattering(rough, (cosine,))[0],
            f"plain_{key}": furnace(plain, (cosine,))[0],
            f"anisotropic_{key}": furnace(long, (cosine,))[0],
        }
    for cosine in (0.05, 0.25, 1.0):
        settings = {"rough": 0.5, "coatRough": 0.1}
        for name, coat in (("bare", 0.0), ("coated", 1.0)):
            one = material(folder, "godot-coat", **settings, coat=coat)
            figures[f"{name}_{cosine:g}"] = furnace(one, (cosine,))[0]
    return figures


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The sections on the masking terms and the coat."""
    last = list(figures.values())[-1]
    rows = "\n".join(
        f"| {rough:g} | {cosine:g} | "
        + " | ".join(f"{last[f'{what}_{rough:g}_{cosine:g}']:.3f}" for what in ("exact", "plain", "anisotropic"))
        + " |"
        for rough, cosine in PLACES
    )
    coats = "\n".join(
        f"| {cosine:g} | {last[f'bare_{cosine:g}']:.3f} | {last[f'coated_{cosine:g}']:.3f} |"
        for cosine in (0.05, 0.25, 1.0)
    )
    return f"""## Two masking terms

`V_GGX` is Hammon's approximation, 0.5 / mix(2 n.l n.v, n.l + n.v, alpha) (PBR Diffuse Lighting for GGX+Smith
Microsurfaces, 2017); `V_GGX_anisotropic` is the exact height-correlated Smith term. At strength 0, both describe
the same surface, yet a material becomes brighter when anisotropy is enabled. The table gives the albedo of white metal:

| roughness | n.v | exact E | with `V_GGX` | with `V_GGX_anisotropic` |
|---|---|---|---|---|
{rows}

The result can be checked by hand: for n.l = n.v = 1/4 and alpha = 1/4, V is 0.5 / (0.25 sqrt(1/16 + 15/256) 2) = 2.87
with Smith's term and 0.5 / (0.75 / 8 + 0.25 / 2) = 2.29 with Hammon's. Remedy: call `V_GGX_anisotropic` with two equal
alphas, or use the exact isotropic Smith term, which requires two square roots.

## The clear coat does not attenuate the base

As a comment in `light_compute` states, the base is not reduced by the light that the coat reflects. The table gives the
albedo of white metal of roughness 0.5, without a coat and with a coat of roughness 0.1:

| n.v | without coat | with coat |
|---|---|---|
{coats}

Remedy: multiply the base's `diffuse_light` and `specular_light` by 1 - F of the coat, as in Filament. In addition,
`Gr` divides by `cLdotH * cLdotH` without a lower bound; the coat of [Bevy](bevy.md) has the same error."""


_ADDED = (
    "`light_compute` adds the diffuse and specular lobes without reducing the diffuse lobe by the light that the "
    "specular lobe reflects. See the white-furnace results for the white dielectric."
)
_COAT = "The coat is added without reducing the base: see [above](#the-clear-coat-does-not-attenuate-the-base)."
_DIGITS = (
    "Near the center of the lobe, 1 - NdotH * NdotH in `D_GGX` loses digits to cancellation. Remedy: compute it as the "
    "squared length of cross(N, H), as in Filament."
)
CAUSES = {
    ("godot-standard", "energy"): _ADDED,
    ("godot-anisotropic", "energy"): _ADDED,
    ("godot-coat", "energy"): _COAT,
    ("godot-coat", "precision"): _DIGITS,
    ("godot-coat", "positivity"): "`Gr` divides by cLdotH * cLdotH without a lower bound. If both directions are "
    "grazing and on opposite sides, the quotient overflows; with coat = 0, infinity is then multiplied by 0. Remedy: "
    "impose a lower bound on cLdotH, as in later releases.",
}

ENGINE = Engine(
    package="godot",
    page="godot",
    title="Godot",
    home="https://github.com/godotengine/godot",
    intro=INTRO,
    materials=("godot-standard", "godot-coat", "godot-anisotropic"),
    furnaces=(
        Furnace("White metal", "godot-standard", lambda r: {"rough": r}),
        Furnace("White dielectric", "godot-standard", lambda r: {"rough": r, "metal": 0.0}),
        Furnace("White metal, anisotropy 0.7", "godot-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, coat of this roughness",
            "godot-coat",
            lambda r: {"metal": 0.0, "coatRough": r},
            "White dielectric with a coat; roughness of the coat varies",
        ),
    ),
    remarks={
        "White metal": "The lobe models single scattering only, without compensation, and loses more light than GGX "
        "with the exact Smith term: see [Two masking terms](#two-masking-terms).",
        "White dielectric": "The diffuse and specular lobes are added without reducing the diffuse lobe. "
        "`DIFFUSE_BURLEY` also gains energy at high roughness.",
        "White metal, anisotropy 0.7": "The loss is that of single-scattering GGX with the exact Smith term.",
        "White dielectric, coat of this roughness": "The base has roughness 0.5; see "
        "[below](#the-clear-coat-does-not-attenuate-the-base).",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
    origin="its repository",
    source="Godot at commit {version} (between releases 4.3 and 4.5)",
    again="git clone https://github.com/godotengine/godot godot-{version}\n"
    "git -C godot-{version} checkout {version}\n"
    "gonio adopt godot-{version} -o godot",
)
