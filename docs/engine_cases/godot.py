"""Godot: furnaces, its two masking terms, its clear coat, and causes."""

from __future__ import annotations

from pathlib import Path

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 0.05), (0.25, 0.25), (0.5, 0.25), (0.5, 1.0), (0.75, 0.5), (1.0, 0.5))

INTRO = """`light_compute` of the clustered forward renderer for one directional light, as `StandardMaterial3D` uses it:
Burley's diffuse lobe and GGX, with clear coat and anisotropy. Environments, rim, backlight and transmittance are not
judged. Roughness and metallic are not rounded to 8 bits, as the renderer does. Later releases multiply the lobe by an
energy compensation, which was not judged."""


def trials(folder: Path) -> dict[str, float]:
    """White metal by both masking terms beside the integral, and with and without a coat."""
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
    """The masking terms, and the coat."""
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
Microsurfaces, 2017); `V_GGX_anisotropic` is the height-correlated Smith term itself. At strength 0 both mean the same
surface, but a material turns brighter when anisotropy is enabled. White metal:

| roughness | n.v | E (integral) | `V_GGX` | `V_GGX_anisotropic` |
|---|---|---|---|---|
{rows}

Without Gonio: for n.l = n.v = 1/4 and alpha = 1/4, V is 0.5 / (0.25 sqrt(1/16 + 15/256) 2) = 2.87 by Smith's term and
0.5 / (0.75 / 8 + 0.25 / 2) = 2.29 by Hammon's. Remedy: `V_GGX_anisotropic` with two equal widths, or the two square
roots of the isotropic term.

## The clear coat is added

As a comment in `light_compute` says, nothing takes from the base what the coat reflects. White metal of roughness
0.5 with a coat of roughness 0.1:

| n.v | without coat | with coat |
|---|---|---|
{coats}

Remedy: `diffuse_light` and `specular_light` of the base times 1 - F of the coat, as in Filament. `Gr` divides by
`cLdotH * cLdotH` without a floor: see [Bevy](bevy.md)."""


_ADDED = (
    "`light_compute` adds the diffuse and the specular lobe; nothing takes from the base what the gloss reflects. See "
    "the furnace of the white dielectric."
)
_COAT = "The coat is added: see above."
_DIGITS = (
    "`D_GGX` computes 1 - NdotH * NdotH, which near the lobe's center is the difference of two numbers near 1. "
    "Remedy: the squared length of cross(N, H), as in Filament."
)
CAUSES = {
    ("godot-standard", "energy"): _ADDED,
    ("godot-anisotropic", "energy"): _ADDED,
    ("godot-coat", "energy"): _COAT,
    ("godot-coat", "precision"): _DIGITS,
    ("godot-coat", "positivity"): "`Gr` divides by cLdotH * cLdotH without a floor. Where both directions graze the "
    "surface from opposite sides it overflows; with coat 0 it is infinity times 0. Remedy: a smallest cLdotH, which "
    "later releases have.",
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
        Furnace("White dielectric, coat of this roughness", "godot-coat", lambda r: {"metal": 0.0, "coatRough": r}),
    ),
    remarks={
        "White metal": "Single scattering without compensation; it loses more than GGX: see [the masking "
        "terms](#two-masking-terms).",
        "White dielectric": "The diffuse and the specular lobe are added. `DIFFUSE_BURLEY` gains light at high "
        "roughness, too.",
        "White metal, anisotropy 0.7": "The loss is that of GGX.",
        "White dielectric, coat of this roughness": "The base has roughness 0.5; see [the "
        "coat](#the-clear-coat-is-added).",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
    origin="its repository (a commit between 4.3 and 4.5)",
    again="git clone https://github.com/godotengine/godot godot-{version}\n"
    "git -C godot-{version} checkout {version}\n"
    "gonio adopt godot-{version} -o godot",
)
