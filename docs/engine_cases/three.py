"""three.js: furnaces, trials with other tables, and causes."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
from gonio.catalog.shaders import files

from . import three_builds
from .base import Engine, Furnace, asymmetry, furnace, material, single_scattering

INTRO = """This card tests MeshStandardMaterial and MeshPhysicalMaterial of WebGLRenderer under directional lights. It
runs the package's own fragment program, `ShaderLib/meshphysical.glsl.js`, for a flat surface without texture maps, with
the defines that WebGLRenderer sets. The two releases tested are the last one before and the newest one after
[#33983](https://github.com/mrdoob/three.js/pull/33983), which replaced the compensation of rough metals. Light from an
environment map follows a different code path (`RE_IndirectSpecular_Physical`) and is not tested here. The materials
three-tsl-... are those of WebGPURenderer, MeshStandardNodeMaterial and MeshPhysicalNodeMaterial. They run the WGSL that
the package's TSL build passes to the device; the two builds are [compared below](#tsl-against-webgl)."""

THREAD = {(0.5, 0.5): (0.90, 1.00), (0.75, 0.5): (0.84, 1.00), (1.0, 0.5): (0.72, 0.94), (1.0, 1.0): (0.58, 0.89)}


def _tables() -> dict[str, np.ndarray]:
    """Tables in place of the package's: of its size but computed here, finer ones, and 16 x 16 from edge to edge."""
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
    """The thread's figures, the table's last texel, and white metal with other tables in place of the package's."""
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
    """Albedos of single lobes at grazing angles, seen through the base that they leave."""
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
    """Largest relative error of D of GGX by the cosine of the half vector, in float32, for the same cosine."""
    cosine = np.cos(np.linspace(0.0, 4.0 * alpha, 2000)).astype(np.float32)
    a2 = np.float32(alpha * alpha)
    rounded = a2 / (np.pi * (cosine * cosine * (a2 - np.float32(1)) + np.float32(1)) ** 2)
    wide = cosine.astype(np.float64)
    exact = alpha**2 / (np.pi * (wide * wide * (alpha**2 - 1) + 1) ** 2)
    return float(np.max(np.abs(rounded / exact - 1.0)))


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The thread's figures, and the trials of the table; by version."""
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
            ("16 x 16, first and last texel at 0 and 1", "edges_16"),
        )
    )
    return f"""## The values reported in #33983

| roughness | n.v | thread: before | {old} | thread: after | {new} |
|---|---|---|---|---|---|
{listed}

The values reported in the thread are confirmed in all four rows, both by Gonio's reading of the shader and by
WebGLRenderer itself ([below](#reproducing-these-results)). Before the change, `BRDF_GGX_Multiscatter` added a lobe
scaled by the product of the losses of both directions. For roughness 1 at normal incidence, single scattering returns
{before["none"]:.3f}, and the added lobe raises this to {before["own"]:.3f}, which recovers
{(before["own"] - before["none"]) / (1 - before["none"]):.0%} of the loss. Equation 16 of Turquin, used in {new},
divides by the energy of single scattering, so that only the errors of the table remain.

## The table clamps at its border texels

`DFGLUTData.js` contains 16 x 16 texels, each computed at its center. `texture2D(dfgLUT, vec2(roughness,
dotNV))` returns the last texel for every coordinate above 31/32. For roughness 1 at normal incidence, it returns
E = {after["texel"]:.4f}, which is correct for the center of the texel ({after["exact_texel"]:.4f}), whereas the energy
for roughness 1 at normal incidence is {after["exact_end"]:.4f}. The quotient,
{after["exact_end"] / after["texel"]:.3f}, is the albedo of white metal. The same happens below 1/32 toward grazing
angles, with the opposite sign. With other tables in the same program, the albedo of white metal is:

| table | roughness 1, n.v 1 | roughness 0.5, n.v 0.02 |
|---|---|---|
{tables}

Remedy at the same size: compute the texels at 0, 1/15, ... 1, scale the coordinates by 15/16 and add 1/32, as
`LTC_Uv` in the same chunk does for its tables.

{three_builds.section(old, before, new, after)}"""


CAUSES = {
    ("three-standard", "reciprocity"): "`multiScatteringCompensation` in `lights_fragment_begin` depends only on n.v, "
    "as in Turquin's equation 16, which trades reciprocity for energy conservation. Without it (E = 1 in the table), "
    "f(wo, wi) and f(wi, wo) differ by {none_asymmetry:.0e} instead of {asymmetry:.2f}. This matters for path tracers, "
    "not for a rasterizer.",
    ("three-standard", "energy"): "The table's first texel is used for every n.v below 1/32: white metal of roughness "
    "0.5 returns {own_grazing:.3f} at n.v 0.02, compared with {centers_256_grazing:.3f} for a table of 256 x 256 "
    "texels.",
    ("three-standard", "energy", "0.185.1"): "With the 16 x 16 table, the added lobe is {own_grazing:.3f} - "
    "{none_grazing:.3f} at roughness 0.5 and n.v 0.02; the sum exceeds 1 only beyond 89 degrees. The loss at all other "
    "angles is due to the term itself (see above).",
    ("three-standard", "precision"): "`D_GGX` computes `dotNH^2 (a2 - 1) + 1`, which is the difference of two "
    "numbers close to 1 near the center of the lobe: at roughness 0.045, this formula alone has errors of up to "
    "{cancellation:.1%} in float32, even if dotNH is exact. Remedy: compute 1 - dotNH^2 as the squared length of "
    "cross(n, h), as in Filament.",
    ("three-standard(metal=0)", "energy"): "A specular lobe is added over a white base; see the white-furnace results "
    "for the white dielectric.",
    ("three-standard(metal=0)", "reciprocity"): "Same as for metal; the factor is 1 + 0.04 (1 / E - 1).",
    ("three-standard(metal=0)", "precision"): "Same as for metal.",
    ("three-standard(metal=0)", "linearity", "0.185.1"): "Same as for metal.",
    (
        "three-standard(metal=0)",
        "linearity",
    ): "Between metal and dielectric, the blended F0 is multiplied by 1 + F0 (1 / E - 1), "
    "so that the color enters squared while its share in the diffuse lobe decreases. An error of this size is "
    "invisible.",
    ("three-standard", "linearity"): "`BRDF_GGX_Multiscatter` multiplies FssEss of both directions by Favg, so that "
    "the color enters only as its third power. An error of this size is invisible.",
    ("three-physical", "reciprocity"): "Same as for the standard material; with a clear coat, the base is also scaled "
    "by 1 - clearcoat F(n.v) at the end of `meshphysical`, which depends only on the view direction.",
    ("three-physical", "energy"): "Sheen and a specular lobe are added over a white base. `IBLSheenBRDF` is the sheen "
    "albedo from which `RE_Direct_Physical` computes the reduction of the base: at sheen roughness 0.25 and n.v 0.05, "
    "the base is reduced by {sheen_taken_25:.2f}, whereas the lobe D_Charlie V_Neubelt reflects {sheen_25:.2f}; at "
    "sheen roughness 0.1, the values are {sheen_taken_10:.2f} and {sheen_10:.2f}, so that the sheen lobe alone gains "
    "light. For the specular lobe, see the white-furnace results for the white dielectric.",
    ("three-anisotropic", "reciprocity"): "Same as for the standard material.",
    (
        "three-anisotropic",
        "energy",
    ): "Same as for the standard material. The loss of up to a fifth at high anisotropy is not "
    "a violation: E is looked up at `roughness`, which is the smaller of the two widths (`alphaT` is larger).",
    ("three-iridescent", "positivity"): "`Fresnel0ToIor` takes the square root of a base reflectance "
    "of 0, and the phase of the film involves a square root at grazing incidence. No value is wrong.",
    ("three-iridescent", "reciprocity"): "Same as for the standard material; in addition, `evalIridescence` is called "
    "with n.v instead of v.h, once for all lights, in 0.185.1 as well.",
    ("three-iridescent", "energy"): "Same as for the standard material.",
    ("three-iridescent", "linearity"): "This is inherent in the model: the reflectance of a film is not linear in "
    "that of its base.",
    ("three-iridescent", "precision"): "Same as for the standard material.",
}

TSL = ("three-tsl-standard", "three-tsl-physical", "three-tsl-anisotropic", "three-tsl-iridescent")
CAUSES |= {
    (name, law): f"Same as for `{name.replace('-tsl', '')}`."
    for name in TSL
    for law in ("positivity", "reciprocity", "energy", "linearity", "precision")
} | {
    (
        "three-tsl-physical",
        "energy",
        "0.185.1",
    ): "Same as for `three-physical`; in addition, `V_Neubelt` is not limited to 1: see [above](#tsl-against-webgl).",
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
        "view angles, v.h is large and F small for most light directions, although the specular lobe reflects far more "
        "than this F suggests: at roughness 0.1 and n.v 0.05, the specular lobe alone returns {gloss:.2f}, and the "
        "diffuse lobe still returns {gloss_diffuse:.2f}. `RE_IndirectDiffuse_Physical` in the same chunk instead uses "
        "1 minus the albedo of the specular lobe. Release 0.185.1 does not reduce the diffuse lobe of direct light at "
        "all.",
        "White, half metal": "The F0 of the dielectric and that of the metal are blended before the compensation "
        "factor, 1 + F0 (1 / E - 1), is applied, although this factor is meant for a single F0; "
        "`RE_IndirectSpecular_Physical` compensates metal and dielectric separately and then blends them.",
        "White metal, anisotropy 0.7": "The engine looks up E in its albedo table at `roughness`, whereas the lobe is "
        "wider along the tangent.",
        "White dielectric, clear coat of this roughness": "The base is scaled by 1 - F(n.v) of a smooth coat, whereas "
        "a rough coat reflects less light than that at grazing angles.",
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
