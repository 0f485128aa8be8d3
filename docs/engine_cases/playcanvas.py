"""PlayCanvas: white furnaces, the alpha in its masking term, the scale of its specular lobe, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, furnace, material, single_scattering

INTRO = """This card covers the lit material with the metalness workflow under one directional light: the chunks
`getLightDiffuse`, `getLightSpecular`, `getFresnel`, `getSpecularModulate` and `combineColor`, called in the order of
`litForwardBackend` and `lightFunctionLight`. Environment maps, area lights, clear coat and iridescence are not tested.
In the white furnaces of metals, a light of intensity 1 has irradiance 1. For materials with a diffuse lobe, the
intensity is 1 / pi, which gives a white diffuse surface an albedo of 1: see
[The scale of the specular lobe](#the-scale-of-the-specular-lobe)."""
PAPER = 1.0 / np.pi  # light intensity at which the albedo of a white diffuse surface is 1


def trials(folder: Path) -> dict[str, float]:
    """Errors of the lobe's formula with alpha^2 and alpha^4 in G; albedos of single lobes at full intensity."""
    rough = 0.7
    lobe = material(folder, "playcanvas-standard", rough=rough)
    random = np.random.default_rng(1)
    z, phi = random.uniform(0.05, 1.0, (2, 2000)), random.uniform(0.0, 2.0 * np.pi, (2, 2000))
    wo, wi = (np.stack([np.sqrt(1 - c * c) * np.cos(p), np.sqrt(1 - c * c) * np.sin(p), c], -1)
              for c, p in zip(z, phi, strict=True))  # fmt: skip
    value = np.asarray(lobe.eval(wo, wi, precision="float64"))[:, 0]
    figures = {}
    for name, a2 in (("meant", rough**4), ("own", rough**8)):
        ratio = value / _metal(wo, wi, rough**4, a2)
        figures |= {f"{name}_off": float(np.max(np.abs(ratio - 1.0))), f"{name}_mean": float(np.mean(ratio))}
    figures |= dict(zip(("grazing", "normal"), furnace(lobe, (0.05, 1.0)), strict=True))
    meant = single_scattering(rough, (0.05, 1.0))
    figures |= dict(zip(("meant_grazing", "meant_normal"), meant, strict=True))
    figures["paper"] = furnace(material(folder, "playcanvas-standard", rough=1.0, metal=0.0), (0.5,))[0]
    for width in (0.05, 0.25, 1.0):
        sheen = material(folder, "playcanvas-sheen", color=0.0, sheenRough=width)
        figures[f"sheen_{width:.0%}"[:-1]] = furnace(sheen, (0.05,))[0]
    return figures


def _metal(wo: np.ndarray, wi: np.ndarray, a2: float, masking: float) -> np.ndarray:
    """D V |cos theta_i| of GGX with alpha^2 = `a2` in D and `masking` in V."""
    half = wo + wi
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    density = a2 / (np.pi * (half[:, 2] ** 2 * (a2 - 1.0) + 1.0) ** 2)
    o, i = wo[:, 2], wi[:, 2]
    slopes = i * np.sqrt(o * o * (1.0 - masking) + masking) + o * np.sqrt(i * i * (1.0 - masking) + masking)
    return np.asarray(density * 0.5 / slopes * i)


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The sections on the alpha in G and the scale of the specular lobe."""
    last = list(figures.values())[-1]
    return f"""## Alpha is squared twice in G

`calcLightSpecular` in `lightSpecularGGX` sets `roughness` to (1 - gloss)^2, which is the alpha of GGX, and `alpha` to
its square. D is correct: it uses `alpha` as alpha^2. G uses `alpha2 = alpha * alpha`, that is, alpha^4, which is the
masking of a smoother surface. The formula D V cos, with alpha^4 in V, reproduces the shader's values within
{last["own_off"]:.0e} for 2,000 random pairs of directions at gloss 0.3, with all cosines 0.05 or more. With alpha^2, as
in Heitz2014, the two differ by up to {last["meant_off"]:.0%}, and the shader is {last["meant_mean"] - 1.0:.0%} brighter
on average. At gloss 0.3, the albedo of white metal is {last["grazing"]:.2f} at n.v 0.05 and {last["normal"]:.2f} at
n.v 1; with alpha^2 in G, it would be {last["meant_grazing"]:.2f} and {last["meant_normal"]:.2f}.
Remedy: use `alpha` instead of `alpha2` in the two square roots. The WGSL chunk of the same name has the same lines;
`lightSpecularAnisoGGX` uses its two alphas correctly.

## The scale of the specular lobe

`getLightDiffuse` returns the cosine without the factor 1 / pi, whereas D contains 1 / pi. Under one light of intensity
1, the albedo of a white dielectric is {last["paper"]:.3f}, and that of white metal is about 1. Relative to the diffuse
lobe, the specular lobe is therefore weaker than in glTF's reference by a factor of pi. If the factor is a choice of
units, it must be the same for both lobes."""


CAUSES = {
    ("playcanvas-standard", "energy"): "G is that of a smoother surface: see [above](#alpha-is-squared-twice-in-g).",
    ("playcanvas-sheen", "energy"): "At all angles, `combineColor` scales the base by 1 - 0.157 times the color of the "
    "sheen, whereas the lobe D V of white sheen alone has an albedo of {sheen_25:.2f} at sheen roughness 0.25 and n.v "
    "0.05 ({sheen_100:.2f} at sheen roughness 1). In addition, the base gains energy because of its masking term (see "
    "[above](#alpha-is-squared-twice-in-g)).",
    ("playcanvas-sheen", "precision"): "At the center of a narrow lobe, `NoH2 * (alpha - 1.0) + 1.0` in the lobe of "
    "the base loses digits to cancellation; at gloss 1, `alpha` is 1e-6. Remedy: compute 1 - NoH^2 as the squared "
    "length of cross(n, h), as in Filament.",
}

ENGINE = Engine(
    package="playcanvas",
    page="playcanvas",
    title="PlayCanvas",
    home="https://github.com/playcanvas/engine",
    intro=INTRO,
    materials=("playcanvas-standard", "playcanvas-anisotropic", "playcanvas-sheen"),
    furnaces=(
        Furnace("White metal", "playcanvas-standard", lambda r: {"rough": r}),
        Furnace(
            "White dielectric, lamp of 1 / pi",
            "playcanvas-standard",
            lambda r: {"rough": r, "metal": 0.0, "lamp": PAPER},
            "White dielectric, light of intensity 1 / pi",
        ),
        Furnace("White metal, anisotropy 0.7", "playcanvas-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, white sheen of this roughness, lamp of 1 / pi",
            "playcanvas-sheen",
            lambda r: {"rough": 0.5, "metal": 0.0, "sheenRough": r, "lamp": PAPER},
            "White dielectric with white sheen, light of intensity 1 / pi; roughness of the sheen varies",
        ),
    ),
    remarks={
        "White metal": "G is that of a smoother surface: see [below](#alpha-is-squared-twice-in-g). At roughness 1, "
        "alpha^2 and alpha^4 are equal, and the loss is that of single scattering.",
        "White dielectric, lamp of 1 / pi": "Without area lights, the diffuse lobe is not multiplied by 1 - F, and the "
        "specular lobe is added to it.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("playcanvas-furnace.html",),
)
