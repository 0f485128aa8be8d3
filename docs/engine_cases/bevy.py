"""Bevy: furnaces, the polynomial of its energy compensation, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 1.0), (0.5, 1.0), (0.75, 1.0), (1.0, 1.0), (1.0, 0.5), (1.0, 0.25))

INTRO = """This card tests the lighting of `StandardMaterial` by a directional light: `Fd_Burley`, `specular`,
`specular_anisotropy` and `specular_clearcoat` of `pbr_lighting.wgsl`, combined as in `directional_light`. Environments,
area lights and transmission are not tested. The feature `dfg_lut`, which is not enabled by default, is off, so that
`F_AB` is a polynomial; with the feature enabled, `F_AB` is read from a table, which was not tested."""


def polynomial(rough: float, cosine: float) -> float:
    """A + B of the split sum's polynomial (Karis, Physically Based Shading on Mobile, 2014)."""
    x, y, z, w = rough * np.array([-1.0, -0.0275, -0.572, 0.022]) + np.array([1.0, 0.0425, 1.04, -0.04])
    a004 = min(x * x, 2.0 ** (-9.28 * cosine)) * x + y
    return float((-1.04 * a004 + z) + (1.04 * a004 + w))


def trials(folder: Path) -> dict[str, float]:
    """White metal: E of the lobe, the polynomial's, and the albedo that both give."""
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
    for rough in (0.5, 0.7):  # a dark color, for which the compensation is next to 1
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
    """The polynomial against the integral."""
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

`specular_multiscatter` multiplies the lobe by 1 + F0 (1 / (A + B) - 1), where A + B = `F_AB` should equal E, the
albedo of the lobe at F = 1, so that white metal returns E / E = 1. Without `DFG_LUT`, A + B is Karis's polynomial for
mobile devices, which was fitted to the split sum for environment lighting and is not E of `V_SmithGGXCorrelated`. The
sum A + B does not depend on n.v at all, because the terms that contain n.v cancel:

| roughness | n.v | E (integral) | A + B | E / (A + B) | white metal of the shader |
|---|---|---|---|---|---|
{rows}

To check this by hand: at n.v 1 and roughness 1, the polynomial gives -0.572 + 1.04 + 0.022 - 0.04 = 0.45, whereas E of
GGX with alpha 1 is 1 - ln 2 = 0.307 at this angle. Remedy: use the table of `dfg_lut` by default, or a fit to E of the
lobe that is used.

## The roughness of anisotropic materials

`specular_anisotropy` sets `ab = roughness * roughness`, but its argument is `layers[LAYER_BASE].roughness`, which
`perceptualRoughnessToRoughness` has already squared. Alpha is therefore the fourth power of the perceptual roughness,
and a material becomes glossier when anisotropy is enabled. The table gives BRDF times cosine at
normal incidence, with color 0.001:

| perceptual roughness r | anisotropic, strength 0 | isotropic at r | isotropic at r^2 |
|---|---|---|---|
{peaks}

KHR_materials_anisotropy of glTF specifies `mix(alpha, 1, strength^2)` with alpha = r^2. Remedy: set `ab = roughness`.
Moreover, `V_GGX_anisotropic` ends in `saturate(v)`, although v exceeds 1 at grazing angles: see the same term of
[glTF-Sample-Viewer](gltf-viewer.md#the-clamp-of-the-anisotropic-masking-term)."""


_METAL = (
    "The polynomial `F_AB` is not E of the lobe: see above. Remedy: use the table of `dfg_lut`, or a fit to E of the "
    "lobe."
)
_COLOR = (
    "`specular_multiscatter` multiplies F by 1 + F0 (1 / (A + B) - 1), so that the result is quadratic in color, as "
    "with every compensation of this kind; light that is reflected twice is colored twice."
)
_DIGITS = (
    "`D_GGX` computes 1 - NdotH * NdotH, which is the difference of two numbers close to 1 near the center of the "
    "lobe. Remedy: compute it as the squared length of cross(N, H), as in Filament."
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
    ("bevy-coat", "positivity"): "`V_Kelemen` divides by LdotH * LdotH without a lower bound. At grazing angles from "
    "opposite sides, the quotient overflows; with coat = 0, the product is then infinity times 0. Remedy: a lower "
    "bound on LdotH.",
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
        "White metal": "See [the polynomial](#the-polynomial-behind-the-energy-compensation).",
        "White dielectric": "`directional_light` adds the diffuse and specular lobes without reducing the diffuse lobe "
        "by the light that the specular lobe reflects. `Fd_Burley` also gains light at high roughness.",
        "White metal, anisotropy 0.7": "See [the roughness](#the-roughness-of-anisotropic-materials).",
        "White dielectric, coat of this roughness": "The base has roughness 0.5 and is weighted by 1 - Fc at the "
        "half vector of each light, as in Filament: at grazing view angles, Fc is small for most light directions.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
    origin="its repository (commit c6f634ca9f)",
    again="git clone --depth 1 --branch v{version} https://github.com/bevyengine/bevy bevy-{version}\n"
    "gonio adopt bevy-{version} -o bevy",
    language="wgsl",
)
