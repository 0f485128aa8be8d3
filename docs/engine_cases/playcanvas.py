"""PlayCanvas: furnaces, the width in its masking term, the scale of gloss beside the diffuse lobe, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, furnace, material, single_scattering

INTRO = """This card tests the lit material with the metalness workflow under one directional light: the chunks
`getLightDiffuse`, `getLightSpecular`, `getFresnel`, `getSpecularModulate` and `combineColor`, called in the order of
`litForwardBackend` and `lightFunctionLight`, without environment, area lights, clear coat or iridescence. In the
furnaces of metal, a light of intensity 1 has irradiance 1. For materials with a diffuse lobe, the intensity is 1 / pi,
so that a white diffuse surface returns 1: see [the scale of both lobes](#gloss-beside-the-diffuse-lobe)."""
PAPER = 1.0 / np.pi  # intensity of a light at which the diffuse lobe reflects its irradiance


def trials(folder: Path) -> dict[str, float]:
    """How well G with either width describes the lobe, and single lobes at full intensity."""
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
    """D V |cos theta_i| of GGX with one squared width in D and another in V."""
    half = wo + wi
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    density = a2 / (np.pi * (half[:, 2] ** 2 * (a2 - 1.0) + 1.0) ** 2)
    o, i = wo[:, 2], wi[:, 2]
    slopes = i * np.sqrt(o * o * (1.0 - masking) + masking) + o * np.sqrt(i * i * (1.0 - masking) + masking)
    return np.asarray(density * 0.5 / slopes * i)


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The width of G, and the scale of gloss."""
    last = list(figures.values())[-1]
    return f"""## The width in G is squared twice

`calcLightSpecular` in `lightSpecularGGX` sets `roughness` to (1 - gloss)^2, which is the alpha of GGX, and `alpha` to
its square. D is correct: it uses `alpha` as alpha^2. G uses `alpha2 = alpha * alpha`, that is, alpha^4, so that the
masking is that of a smoother surface, of width alpha^2. With alpha^4, the formula D V cos gives the shader's values
within {last["own_off"]:.0e} for 2,000 random pairs at gloss 0.3, in which all cosines are 0.05 or more; with alpha^2,
as in Heitz2014, they differ by up to {last["meant_off"]:.0%}, and the shader is {last["meant_mean"] - 1.0:.0%} brighter
on average. White metal of gloss 0.3 returns {last["grazing"]:.2f} at n.v 0.05 and {last["normal"]:.2f} at n.v 1; with
alpha^2 in G, it would return {last["meant_grazing"]:.2f} and {last["meant_normal"]:.2f}.
Remedy: use `alpha` instead of `alpha2` in the two square roots. The WGSL chunk of the same name has the same lines;
`lightSpecularAnisoGGX` uses its widths correctly.

## Gloss beside the diffuse lobe

`getLightDiffuse` is the cosine without the factor 1 / pi, whereas D contains 1 / pi. Under one light of intensity 1, a
white dielectric returns {last["paper"]:.3f} and white metal about 1. Relative to the diffuse lobe, the specular lobe
is therefore weaker than in glTF's reference by a factor of pi. If this is a choice of units, both lobes need the same
units."""


CAUSES = {
    ("playcanvas-standard", "energy"): "G is that of a smoother surface: see "
    "[above](#the-width-in-g-is-squared-twice).",
    ("playcanvas-sheen", "energy"): "`combineColor` scales the base by 1 - 0.157 times the color of the sheen at "
    "all angles, whereas the lobe D V of white sheen alone reflects {sheen_25:.2f} at width 0.25 and n.v 0.05 "
    "({sheen_100:.2f} at width 1). In addition, the base gains light as above.",
    ("playcanvas-sheen", "precision"): "`NoH2 * (alpha - 1.0) + 1.0` in the lobe of the base is the difference of two "
    "numbers close to 1 at the center of a narrow lobe; at gloss 1, `alpha` is 1e-6. Remedy: compute 1 - NoH^2 as the "
    "squared length of cross(n, h), as in Filament.",
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
        "White metal": "G is that of a smoother surface: see [below](#the-width-in-g-is-squared-twice). At roughness "
        "1, both widths are the same, and the loss is that of single scattering.",
        "White dielectric, lamp of 1 / pi": "Without area lights, the diffuse lobe is not reduced by F, and the "
        "specular lobe is added to it.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("playcanvas-furnace.html",),
)
