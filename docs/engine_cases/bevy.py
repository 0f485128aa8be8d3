"""Bevy: furnaces, the polynomial of its energy compensation, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 1.0), (0.5, 1.0), (0.75, 1.0), (1.0, 1.0), (1.0, 0.5), (1.0, 0.25))

INTRO = """This card covers the lighting of `StandardMaterial` by a directional light: `Fd_Burley`, `specular`,
`specular_anisotropy` and `specular_clearcoat` of `pbr_lighting.wgsl`, combined as in `directional_light`. Environment
maps, area lights and transmission are not tested. The feature `dfg_lut` is off, as it is by default, and `F_AB` is
therefore a polynomial. With the feature enabled, `F_AB` is read from a table; this variant was not tested."""


def polynomial(rough: float, cosine: float) -> float:
    """A + B of the split sum, approximated by a polynomial (Karis, Physically Based Shading on Mobile, 2014)."""
    x, y, z, w = rough * np.array([-1.0, -0.0275, -0.572, 0.022]) + np.array([1.0, 0.0425, 1.04, -0.04])
    a004 = min(x * x, 2.0 ** (-9.28 * cosine)) * x + y
    return float((-1.04 * a004 + z) + (1.04 * a004 + w))


def trials(folder: Path) -> dict[str, float]:
    """For white metal, E of the lobe, A + B, their ratio, and the shader's albedo; peaks of dark materials."""
    figures = {}
    for rough, cosine in PLACES:
        key = f"{rough:g}_{cosine:g}"
        exact, fit = single_scattering(rough, (cosine,))[0], polynomial(rough, cosine)
        figures |= {
            f"exact_{key}": exact,
            f"fit_{key}": fit,
            f"expected_{key}": exact / fit,
            f"shader_{key}": furnace(material(folder, "bevy-standard", rough=rough), (cosine,))[0],
        }
    for rough in (0.5, 0.7):  # a dark color, for which the compensation factor is close to 1
        normal = np.array([[0.0, 0.0, 1.0]])
        for name, settings in (
            ("anisotropic", {"rough": rough, "strength": 0.0}),
            ("standard", {"rough": rough}),
            ("standard", {"rough": rough * rough}),
        ):
            made = material(folder, f"bevy-{name}", color=1e-3, **settings)
            peak = made.eval(normal, normal, precision="float64")[0, 0]
            figures[f"peak_{name}_{rough:g}_{settings['rough']:.2f}"] = float(peak)
    return figures


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The comparison of the polynomial with the exact integral, and the roughness of anisotropic materials."""
    last = list(figures.values())[-1]
    rows = "\n".join(
        f"| {rough:g} | {cosine:g} | "
        + " | ".join(f"{last[f'{what}_{rough:g}_{cosine:g}']:.3f}" for what in ("exact", "fit", "expected", "shader"))
        + " |"
        for rough, cosine in PLACES
    )
    peaks = "\n".join(
        f"| {rough:g} | {last[f'peak_anisotropic_{rough:g}_{rough:.2f}']:.6f} | "
        f"{last[f'peak_standard_{rough:g}_{rough:.2f}']:.6f} | {last[f'peak_standard_{rough:g}_{rough**2:.2f}']:.6f} |"
        for rough in (0.5, 0.7)
    )
    return f"""## The polynomial behind the energy compensation

`specular_multiscatter` multiplies the lobe by 1 + F0 (1 / (A + B) - 1). The sum A + B, `F_AB`, should equal E, the
albedo of the lobe at F = 1; the albedo of white metal would then be E / E = 1. Without `DFG_LUT`, A + B is Karis's
polynomial for mobile devices. It was fitted to the split sum for environment lighting and differs from E of
`V_SmithGGXCorrelated`. It does not even depend on n.v, because the terms that contain n.v cancel in the sum. The table
compares A + B with E:

| roughness | n.v | exact E | A + B | E / (A + B) | albedo of white metal |
|---|---|---|---|---|---|
{rows}

The result can be checked by hand: at n.v 1 and roughness 1, the polynomial gives -0.572 + 1.04 + 0.022 - 0.04 = 0.45,
whereas E of GGX with alpha 1 is 1 - ln 2 = 0.307 at normal incidence. Remedy: use the table of `dfg_lut` by default, or
fit a polynomial to E of this lobe.

## The roughness of anisotropic materials

`specular_anisotropy` sets `ab = roughness * roughness`, but its argument is `layers[LAYER_BASE].roughness`, which
`perceptualRoughnessToRoughness` has already squared. Alpha is therefore the fourth power of the perceptual roughness,
and a material becomes glossier when anisotropy is enabled. The table gives the product of BRDF and cosine at normal
incidence, for color 0.001:

| perceptual roughness r | anisotropic, strength 0 | isotropic, roughness r | isotropic, roughness r^2 |
|---|---|---|---|
{peaks}

KHR_materials_anisotropy of glTF specifies `mix(alpha, 1, strength^2)` with alpha = r^2. Remedy: set `ab = roughness`.
In addition, `V_GGX_anisotropic` returns `saturate(v)`, although v exceeds 1 at grazing angles;
[glTF-Sample-Viewer](gltf-viewer.md#the-clamp-of-the-anisotropic-masking-term) has the same error."""


_METAL = (
    "The polynomial `F_AB` differs from E of the lobe: see [above](#the-polynomial-behind-the-energy-compensation). "
    "Remedy: use the table of `dfg_lut`, or fit a polynomial to E of the lobe."
)
_COLOR = (
    "`specular_multiscatter` multiplies F by 1 + F0 (1 / (A + B) - 1). The result is therefore quadratic in color, as "
    "with every compensation of this kind: light that is reflected twice is tinted twice."
)
_DIGITS = (
    "Near the center of the lobe, 1 - NdotH * NdotH in `D_GGX` loses digits to cancellation. Remedy: compute it as the "
    "squared length of cross(N, H), as in Filament."
)
CAUSES = {
    ("bevy-standard", "energy"): _METAL,
    ("bevy-coat", "energy"): _METAL,
    ("bevy-anisotropic", "energy"): _METAL,
    ("bevy-standard", "linearity"): _COLOR,
    ("bevy-coat", "linearity"): _COLOR,
    ("bevy-anisotropic", "linearity"): _COLOR,
    ("bevy-standard", "precision"): _DIGITS,
    ("bevy-coat", "precision"): _DIGITS,
    ("bevy-coat", "positivity"): "`V_Kelemen` divides by LdotH * LdotH without a lower bound. If both directions are "
    "grazing and on opposite sides, the quotient overflows; with coat = 0, infinity is then multiplied by 0. Remedy: "
    "impose a lower bound on LdotH.",
}

ENGINE = Engine(
    package="bevy",
    page="bevy",
    title="Bevy",
    home="https://github.com/bevyengine/bevy",
    intro=INTRO,
    materials=("bevy-standard", "bevy-coat", "bevy-anisotropic"),
    furnaces=(
        Furnace("White metal", "bevy-standard", lambda r: {"rough": r}),
        Furnace("White dielectric", "bevy-standard", lambda r: {"rough": r, "metal": 0.0}),
        Furnace("White metal, anisotropy 0.7", "bevy-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, coat of this roughness",
            "bevy-coat",
            lambda r: {"metal": 0.0, "coatRough": r},
            "White dielectric with a coat; roughness of the coat varies",
        ),
    ),
    remarks={
        "White metal": "See [the polynomial behind the energy "
        "compensation](#the-polynomial-behind-the-energy-compensation).",
        "White dielectric": "`directional_light` adds the diffuse and specular lobes without reducing the diffuse lobe "
        "by the light that the specular lobe reflects. `Fd_Burley` also gains energy at high roughness.",
        "White metal, anisotropy 0.7": "See [the roughness of anisotropic "
        "materials](#the-roughness-of-anisotropic-materials).",
        "White dielectric, coat of this roughness": "The base has roughness 0.5. It is weighted by 1 - Fc, where Fc is "
        "the Fresnel term of the coat at the half vector of each light, as in Filament. At grazing view angles, Fc is "
        "small for most light directions.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
    origin="GitHub (commit c6f634ca9f)",
    again="git clone --depth 1 --branch v{version} https://github.com/bevyengine/bevy bevy-{version}\n"
    "gonio adopt bevy-{version} -o bevy",
    language="wgsl",
)
