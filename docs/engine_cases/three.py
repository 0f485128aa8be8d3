"""three.js: white furnaces, trials with other tables, and causes."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
from gonio.catalog.shaders import files

from . import three_builds
from .base import Engine, Furnace, asymmetry, furnace, material, single_scattering

INTRO = """This card covers MeshStandardMaterial and MeshPhysicalMaterial of WebGLRenderer under directional lights. The
tests run the package's own fragment program, `ShaderLib/meshphysical.glsl.js`, for a flat surface without texture maps,
with the defines that WebGLRenderer sets. The two releases are the last one before
[#33983](https://github.com/mrdoob/three.js/pull/33983), which replaced the energy compensation of rough metals, and the
newest one after it; in the tables, an arrow separates their values. Light from an environment map follows a different
code path (`RE_IndirectSpecular_Physical`) and is not tested here. The materials named three-tsl-... are
MeshStandardNodeMaterial and MeshPhysicalNodeMaterial of WebGPURenderer. For these, the tests run the WGSL code that the
package's TSL build passes to WebGPU; the two builds are [compared below](#tsl-against-webgl)."""

THREAD = {(0.5, 0.5): (0.90, 1.00), (0.75, 0.5): (0.84, 1.00), (1.0, 0.5): (0.72, 0.94), (1.0, 1.0): (0.58, 0.89)}


def _tables() -> dict[str, np.ndarray]:
    """Tables that replace the package's: recomputed ones of equal and higher resolution, one with texels at 0, 1."""
    tables = {}
    for size in (16, 64, 256):
        dfg = np.asarray(go.bake("ggx", lut=["dfg"], resolution=size).arrays["dfg"])
        tables[f"centers_{size}"] = np.swapaxes(dfg, 0, 1)  # rows by n.v
    nodes = np.linspace(0.0, 1.0, 16)
    cosines = tuple(float(x) for x in np.maximum(nodes, 1e-3))
    energy = np.array([single_scattering(max(float(r), 0.045), cosines) for r in nodes]).T
    dense = (np.arange(512) + 0.5) / 512 * 15  # 16 nodes at 0 ... 1, with linear lookups between them
    low = np.minimum(dense.astype(int), 14)
    part = dense - low
    rows = energy[low] * (1 - part)[:, None] + energy[low + 1] * part[:, None]
    both = rows[:, low] * (1 - part) + rows[:, low + 1] * part
    tables["edges_16"] = np.stack([both, np.zeros_like(both)], -1)
    tables["none"] = np.stack([np.ones((2, 2)), np.zeros((2, 2))], -1)  # E = 1: no compensation
    return tables


def trials(folder: Path) -> dict[str, float]:
    """Values reported in the thread, the last texel of the table, and white metal with other tables."""
    own = np.load(folder / "dfgLUT.npy")
    figures = {
        f"thread_{roughness:g}_{cosine:g}": furnace(material(folder, "three-standard", rough=roughness), (cosine,))[0]
        for roughness, cosine in THREAD
    }
    figures |= {
        "texel": float(own[-1, -1].sum()),
        "exact_texel": single_scattering(31 / 32, (31 / 32,))[0],
        "exact_end": single_scattering(1.0, (1.0,))[0],
        "asymmetry": asymmetry(material(folder, "three-standard", rough=0.5)),
        "own": furnace(material(folder, "three-standard", rough=1.0), (1.0,))[0],
        "own_grazing": furnace(material(folder, "three-standard", rough=0.5), (0.02,))[0],
    }
    try:
        for name, table in _tables().items():
            np.save(folder / "dfgLUT.npy", table)
            files.forget()
            figures[name] = furnace(material(folder, "three-standard", rough=1.0), (1.0,))[0]
            figures[f"{name}_grazing"] = furnace(material(folder, "three-standard", rough=0.5), (0.02,))[0]
        figures["none_asymmetry"] = asymmetry(material(folder, "three-standard", rough=0.5))
    finally:
        np.save(folder / "dfgLUT.npy", own)
        files.forget()
    return figures | _layers(folder) | three_builds.trials(folder)


def _layers(folder: Path) -> dict[str, float]:
    """Albedos of single lobes at grazing angles, and the fraction by which sheen attenuates the base."""
    bare = furnace(material(folder, "three-physical", rough=0.5), (0.05,))[0]
    figures = {}
    for width in (0.1, 0.25):
        sheen = {"sheen": 1.0, "sheenWidth": width, "rough": 0.5}
        lobe = material(folder, "three-physical", color=0.0, specularWeight=0.0, **sheen)
        albedo = furnace(lobe, (0.05,))[0]
        whole = furnace(material(folder, "three-physical", **sheen), (0.05,))[0]
        figures |= {f"sheen_{width:.0%}"[:-1]: albedo, f"sheen_taken_{width:.0%}"[:-1]: 1.0 - (whole - albedo) / bare}
    figures["cancellation"] = _cancellation(0.045**2)
    specular = furnace(material(folder, "three-standard", rough=0.1, metal=0.0, color=0.0), (0.05,))[0]
    both = furnace(material(folder, "three-standard", rough=0.1, metal=0.0), (0.05,))[0]
    return figures | {"gloss": specular, "gloss_diffuse": both - specular}


def _cancellation(alpha: float) -> float:
    """Largest relative error of GGX's D in float32, as a function of the exact cosine of the half vector."""
    cosine = np.cos(np.linspace(0.0, 4.0 * alpha, 2000)).astype(np.float32)
    a2 = np.float32(alpha * alpha)
    rounded = a2 / (np.pi * (cosine * cosine * (a2 - np.float32(1)) + np.float32(1)) ** 2)
    wide = cosine.astype(np.float64)
    exact = alpha**2 / (np.pi * (wide * wide * (alpha**2 - 1) + 1) ** 2)
    return float(np.max(np.abs(rounded / exact - 1.0)))


def sections(figures: dict[str, dict[str, float]]) -> str:
    """Sections on the values in the thread, the table of E and the TSL build, from values keyed by version."""
    (old, before), (new, after) = figures.items()
    rows = [
        f"| {roughness:g} | {cosine:g} | {stated[0]:.2f} | {before[f'thread_{roughness:g}_{cosine:g}']:.3f} | "
        f"{stated[1]:.2f} | {after[f'thread_{roughness:g}_{cosine:g}']:.3f} |"
        for (roughness, cosine), stated in THREAD.items()
    ]
    listed = "\n".join(rows)
    tables = "\n".join(
        f"| {title} | {after[name]:.3f} | {after[f'{name}_grazing']:.3f} |"
        for title, name in (
            ("16 x 16, from the package", "own"),
            ("16 x 16, recomputed at the same texel centers", "centers_16"),
            ("64 x 64", "centers_64"),
            ("256 x 256", "centers_256"),
            ("16 x 16, first and last texels at 0 and 1", "edges_16"),
        )
    )
    return f"""## The values reported in #33983

| roughness | n.v | before, as reported | {old}, measured | after, as reported | {new}, measured |
|---|---|---|---|---|---|
{listed}

The table gives the albedo of white metal before and after the change. Gonio's evaluation of the shader confirms the
values reported in the thread in all four rows, and so does WebGLRenderer itself
([below](#reproducing-these-results)). Before the change, `BRDF_GGX_Multiscatter` added a lobe scaled by the product of
the energy losses 1 - E in both directions. At roughness 1 and normal incidence, the albedo of single scattering is
{before["none"]:.3f}; the added lobe raises it to {before["own"]:.3f} and thus recovers
{(before["own"] - before["none"]) / (1 - before["none"]):.0%} of the loss. Turquin's equation 16, used in {new},
divides by the albedo of single scattering; only the errors of the table remain.

## The table of E is clamped at its border texels

`DFGLUTData.js` contains 16 x 16 texels, each computed at its center. `texture2D(dfgLUT, vec2(roughness,
dotNV))` returns the last texel for every coordinate above 31/32. At roughness 1 and normal incidence, this texel gives
E = {after["texel"]:.4f}. The value is correct at the center of the texel ({after["exact_texel"]:.4f}), but the exact E
at roughness 1 and normal incidence is {after["exact_end"]:.4f}. The quotient,
{after["exact_end"] / after["texel"]:.3f}, is the albedo of white metal. At grazing angles, where n.v is below 1/32, the
lookup is clamped in the same way, and the error has the opposite sign. The following table gives the albedo of white
metal if the same program uses other tables:

| table | roughness 1, n.v 1 | roughness 0.5, n.v 0.02 |
|---|---|---|
{tables}

Remedy without a larger table: compute the texels at 0, 1/15, ..., 1, scale the coordinates by 15/16 and add 1/32, as
`LTC_Uv` in the same chunk does for its tables.

{three_builds.section(old, before, new, after)}"""


CAUSES = {
    ("three-standard", "reciprocity"): "`multiScatteringCompensation` in `lights_fragment_begin` depends only on n.v, "
    "as in Turquin's equation 16, which trades reciprocity for energy conservation. Without it (E = 1 in the table), "
    "the largest relative difference between f(wo, wi) and f(wi, wo) is {none_asymmetry:.0e} instead of "
    "{asymmetry:.2f}. Reciprocity matters to path tracers but not to rasterizers.",
    ("three-standard", "energy"): "The table's first texel is used for every n.v below 1/32: the albedo of white metal "
    "of roughness 0.5 is {own_grazing:.3f} at n.v 0.02, compared with {centers_256_grazing:.3f} for a table of 256 x "
    "256 texels.",
    ("three-standard", "energy", "0.185.1"): "At roughness 0.5 and n.v 0.02, the compensation lobe raises the albedo "
    "from {none_grazing:.3f} to {own_grazing:.3f} with the 16 x 16 table; the albedo exceeds 1 only beyond 89 degrees. "
    "The loss at all other angles is due to the compensation term itself (see [above](#the-values-reported-in-33983)).",
    ("three-standard", "precision"): "Near the center of the lobe, `dotNH^2 (a2 - 1) + 1` in `D_GGX` loses digits to "
    "cancellation: at roughness 0.045, D has errors of up to {cancellation:.1%} in float32 even if dotNH is exact. "
    "Remedy: compute 1 - dotNH^2 as the squared length of cross(n, h), as in Filament.",
    ("three-standard(metal=0)", "energy"): "The specular lobe is added to a white base that is attenuated too little; "
    "see the white-furnace results for the white dielectric.",
    ("three-standard(metal=0)", "reciprocity"): "same as for metal; the compensation factor is 1 + 0.04 (1 / E - 1).",
    ("three-standard(metal=0)", "precision"): "same as for metal.",
    ("three-standard(metal=0)", "linearity", "0.185.1"): "same as for metal.",
    (
        "three-standard(metal=0)",
        "linearity",
    ): "If a material is partly metallic, its blended F0 is multiplied by 1 + F0 (1 / E - 1). The color therefore "
    "enters squared, while its share in the diffuse lobe decreases. An error of this size is invisible.",
    ("three-standard", "linearity"): "`BRDF_GGX_Multiscatter` multiplies FssEss of both directions by Favg. This "
    "product depends on the third power of the color. An error of this size is invisible.",
    ("three-physical", "reciprocity"): "same as for the standard material; with a clear coat, the end of "
    "`meshphysical` also scales the base by 1 - clearcoat F(n.v), which depends only on the view direction.",
    ("three-physical", "energy"): "The sheen and specular lobes are added to a white base that is attenuated too "
    "little. `RE_Direct_Physical` computes the attenuation due to sheen from `IBLSheenBRDF`, a fit of the sheen "
    "albedo: at sheen roughness 0.25 and n.v 0.05, the base is reduced by a fraction of {sheen_taken_25:.2f}, whereas "
    "the lobe D_Charlie V_Neubelt has an albedo of {sheen_25:.2f}. At sheen roughness 0.1, the values are "
    "{sheen_taken_10:.2f} and {sheen_10:.2f}: the sheen lobe alone gains energy. For the specular lobe, see the "
    "white-furnace results for the white dielectric.",
    ("three-anisotropic", "reciprocity"): "same as for the standard material.",
    (
        "three-anisotropic",
        "energy",
    ): "same as for the standard material. At high anisotropy, up to a fifth of the light is lost, because E is looked "
    "up at `roughness`, the smaller of the two widths (`alphaT` is larger); a loss does not violate the law.",
    ("three-iridescent", "positivity"): "`Fresnel0ToIor` takes the square root of the base reflectance, which is 0 "
    "here, and the phase of the film contains a square root that is 0 at grazing incidence. The values are correct; "
    "only their derivatives are not finite.",
    ("three-iridescent", "reciprocity"): "Both releases call `evalIridescence` once for all lights, with n.v instead "
    "of v.h; in 0.187.0, the cause given for the standard material applies as well.",
    ("three-iridescent", "energy"): "same as for the standard material.",
    ("three-iridescent", "linearity"): "The nonlinearity is inherent in the model: the reflectance of a thin film is "
    "not linear in that of its base.",
    ("three-iridescent", "precision"): "same as for the standard material.",
}

TSL = ("three-tsl-standard", "three-tsl-physical", "three-tsl-anisotropic", "three-tsl-iridescent")
CAUSES |= {
    (name, law): f"same as for `{name.replace('-tsl', '')}`."
    for name in TSL
    for law in ("positivity", "reciprocity", "energy", "linearity", "precision")
} | {
    (
        "three-tsl-physical",
        "energy",
        "0.185.1",
    ): "same as for `three-physical`; in addition, `V_Neubelt` is not limited to 1: see [above](#tsl-against-webgl).",
}

ENGINE = Engine(
    package="three",
    page="three",
    title="three.js",
    home="https://github.com/mrdoob/three.js",
    intro=INTRO,
    materials=(
        "three-standard",
        "three-standard(metal=0)",
        "three-physical",
        "three-anisotropic",
        "three-iridescent",
        *TSL,
    ),
    furnaces=(
        Furnace("White metal", "three-standard", lambda r: {"rough": r}),
        Furnace("White dielectric", "three-standard", lambda r: {"rough": r, "metal": 0.0}),
        Furnace("White, half metal", "three-standard", lambda r: {"rough": r, "metal": 0.5}),
        Furnace("White metal, anisotropy 0.7", "three-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, clear coat of this roughness",
            "three-physical",
            lambda r: {"rough": 0.5, "coat": 1.0, "coatRoughness": r},
            "White dielectric with a clear coat; roughness of the coat varies",
        ),
        Furnace(
            "White dielectric, white sheen of this roughness",
            "three-physical",
            lambda r: {"rough": 0.5, "sheen": 1.0, "sheenWidth": r},
            "White dielectric with white sheen; roughness of the sheen varies",
        ),
        Furnace(
            "White dielectric, coat and sheen",
            "three-physical",
            lambda r: {"rough": 0.5, "coat": 1.0, "coatRoughness": r, "sheen": 1.0, "sheenWidth": r},
        ),
        Furnace(
            "White dielectric, coat and sheen, TSL",
            "three-tsl-physical",
            lambda r: {"rough": 0.5, "coat": 1.0, "coatRoughness": r, "sheen": 1.0, "sheenWidth": r},
        ),
    ),
    remarks={
        "White dielectric": "`RE_Direct_Physical` scales the diffuse lobe by 1 - F(v.h) for each light. At grazing "
        "view angles, v.h is large and F(v.h) is small for most light directions, although the albedo of the specular "
        "lobe is much larger than these values of F: at roughness 0.1 and n.v 0.05, it is {gloss:.2f}, and that of the "
        "diffuse lobe is still {gloss_diffuse:.2f}. In the same chunk, `RE_IndirectDiffuse_Physical` uses 1 minus the "
        "albedo of the specular lobe instead. Release 0.185.1 does not reduce the diffuse lobe of direct light at all.",
        "White, half metal": "The F0 of the dielectric and that of the metal are blended before the compensation "
        "factor, 1 + F0 (1 / E - 1), is applied, although this factor is meant for a single F0; "
        "`RE_IndirectSpecular_Physical` compensates the metal and the dielectric separately before it blends them.",
        "White metal, anisotropy 0.7": "The engine looks up E in its albedo table at `roughness`, whereas the lobe is "
        "wider along the tangent.",
        "White dielectric, clear coat of this roughness": "The base is scaled by 1 - F(n.v), the factor for a smooth "
        "coat, although a rough coat reflects less light at grazing angles.",
        "White dielectric, coat and sheen": "The roughness in the table is that of the coat and the sheen; the "
        "base has roughness 0.5.",
        "White dielectric, coat and sheen, TSL": "The coat does not attenuate the sheen: see "
        "[below](#tsl-against-webgl).",
        "White dielectric, white sheen of this roughness": "`IBLSheenBRDF` is smaller than the albedo of the lobe at "
        "low sheen roughness and grazing angles; see *energy* below.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("three-furnace.html",),
    tsl=True,
)
