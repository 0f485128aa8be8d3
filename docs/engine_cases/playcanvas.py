"""PlayCanvas: furnaces, the width in its masking term, the scale of gloss beside the diffuse lobe, and causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import Engine, Furnace, furnace, material, single_scattering

INTRO = """The lit material with the metalness workflow under one directional light: the chunks `getLightDiffuse`,
`getLightSpecular`, `getFresnel`, `getSpecularModulate` and `combineColor`, called in the order of `litForwardBackend`
and `lightFunctionLight`, without environment, area lights, clear coat and iridescence. A lamp of intensity 1 has
irradiance 1 in the furnaces of metal. Beside a diffuse lobe its intensity is 1 / pi, so that white paper returns 1: see
the scale of gloss below."""
PAPER = 1.0 / np.pi  # intensity of a lamp at which the diffuse lobe reflects its irradiance


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
its square. D is right: it takes `alpha` for alpha^2. G takes `alpha2 = alpha * alpha`, alpha^4, so that it masks as a
surface of width alpha^2 would, which is smoother. With alpha^4 the formula D V cos gives the shader's values within
{last["own_off"]:.0e} for 2,000 random pairs at gloss 0.3, in which all cosines are 0.05 or more; with alpha^2, as in
Heitz2014, they differ by up to {last["meant_off"]:.0%}, and the shader is {last["meant_mean"] - 1.0:.0%} brighter on
average. White metal of gloss 0.3 returns {last["grazing"]:.2f} at n.v 0.05 and {last["normal"]:.2f} at n.v 1; with
alpha^2 in G it would return {last["meant_grazing"]:.2f} and {last["meant_normal"]:.2f}.
Remedy: `alpha` in place of `alpha2` in the two roots. The WGSL chunk of the same name has the same lines, and
`lightSpecularAnisoGGX` takes its widths right.

## Gloss beside the diffuse lobe

`getLightDiffuse` is the cosine, without 1 / pi, while D contains 1 / pi. Under one lamp of intensity 1 white paper
returns {last["paper"]:.3f}, and white metal about 1, so that gloss is pi times as weak beside a diffuse lobe as in
glTF's reference. If this is a choice of units, the two lobes need the same."""


CAUSES = {
    ("playcanvas-standard", "energy"): "G of a smoother surface: see the width in G.",
    ("playcanvas-sheen", "energy"): "`combineColor` scales the base by 1 - 0.157 of the sheen's color at all angles, "
    "while the lobe D V of white sheen alone reflects {sheen_25:.2f} at width 0.25 and n.v 0.05 ({sheen_100:.2f} at "
    "width 1). The base gains as above.",
    ("playcanvas-sheen", "precision"): "`NoH2 * (alpha - 1.0) + 1.0` in the lobe of the base is the difference of two "
    "numbers near 1 at the center of a narrow lobe; at gloss 1 `alpha` is 1e-6. Remedy: 1 - NoH^2 as the squared "
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
        ),
        Furnace("White metal, anisotropy 0.7", "playcanvas-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, white sheen of this roughness, lamp of 1 / pi",
            "playcanvas-sheen",
            lambda r: {"rough": 0.5, "metal": 0.0, "sheenRough": r, "lamp": PAPER},
        ),
    ),
    remarks={
        "White metal": "See the width in G. At roughness 1 both widths are the same, and the loss is that of single "
        "scattering.",
        "White dielectric, lamp of 1 / pi": "Without area lights the diffuse lobe is not reduced by F; gloss adds to "
        "it.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("playcanvas-furnace.html",),
)
