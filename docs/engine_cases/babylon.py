"""Babylon.js: white furnaces, the angle of the diffuse lobe's Fresnel factor, the energy of the clear coat, causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from gonio.catalog.shaders import files

from .base import Engine, Furnace, asymmetry, furnace, material, single_scattering

INTRO = """This card covers PBRMaterial of the WebGL engine under directional lights. The tests run the package's own
fragment program, `Shaders/pbr.fragment.js`, for a flat surface without texture maps, with the defines that the class
sets.
`babylon-standard` has the defaults of `new PBRMaterial`; `babylon-conserving` has
`brdf.useLegacySpecularEnergyConservation = false`. Light from an environment map follows a different code path and is
not tested here. The albedo of white metal is within 1% of 1 at all roughnesses and angles, which is the best result
among all engines with a report card."""

_LOW = 0.1  # cosine of the view and light directions in the test of the diffuse lobe at grazing angles


def trials(folder: Path) -> dict[str, float]:
    """Diffuse lobe as a function of the half vector, coat over two bases, sheen table, metal without compensation."""
    figures = _diffuse(folder) | _coat(folder)
    table = np.load(folder / "environmentBrdf.npy")
    figures["asymmetry"] = asymmetry(material(folder, "babylon-standard", rough=0.5))
    try:
        np.save(folder / "environmentBrdf.npy", np.ones_like(table))  # E = 1: no compensation
        files.forget()
        figures["none_asymmetry"] = asymmetry(material(folder, "babylon-standard", rough=0.5))
    finally:
        np.save(folder / "environmentBrdf.npy", table)
        files.forget()
    for width in (0.1, 0.25):
        sheened = furnace(material(folder, "babylon-sheen", rough=0.5, sheenRough=width), (0.05,))[0]
        kept = 1.0 - _lookup(table, width, 0.05)[2]
        lobe = sheened - kept * furnace(material(folder, "babylon-standard", rough=0.5, metal=0.0), (0.05,))[0]
        figures |= {f"sheen_{width:.0%}"[:-1]: lobe, f"sheen_taken_{width:.0%}"[:-1]: 1.0 - kept}
    texels = [(r, c) for r in (0.25, 0.5, 0.75, 1.0) for c in (0.1, 0.5, 1.0)]
    exact = [single_scattering(min(float(np.sqrt(r * r + 5e-4)), 1.0), (c,))[0] for r, c in texels]
    figures["table"] = max(abs(_lookup(table, r, c)[1] / e - 1.0) for (r, c), e in zip(texels, exact, strict=True))
    return figures | _smooth(folder)


def _lookup(table: np.ndarray, rough: float, cosine: float) -> np.ndarray:
    """Bilinear lookup in the table, whose rows are indexed by roughness and whose columns by n.v."""
    count = table.shape[0]
    row, column = (np.clip(x * count - 0.5, 0.0, count - 1.001) for x in (rough, cosine))
    r, c = int(row), int(column)
    both = table[r : r + 2, c : c + 2]
    rows = both[0] * (1.0 - row + r) + both[1] * (row - r)
    return np.asarray(rows[0] * (1.0 - column + c) + rows[1] * (column - c))


def _diffuse(folder: Path) -> dict[str, float]:
    """Diffuse lobe of a white dielectric as a function of the half vector; albedos of its two lobes."""
    random = np.random.default_rng(1)
    z, phi = random.uniform(0.05, 1.0, (2, 2000)), random.uniform(0.0, 2.0 * np.pi, (2, 2000))
    wo, wi = (np.stack([np.sqrt(1 - c * c) * np.cos(p), np.sqrt(1 - c * c) * np.sin(p), c], -1)
              for c, p in zip(z, phi, strict=True))  # fmt: skip
    side = np.sqrt(1.0 - _LOW * _LOW)
    wo[:2] = (side, 0.0, _LOW)
    wi[:2] = (side, 0.0, _LOW), (-side, 0.0, _LOW)
    lobes = [material(folder, "babylon-conserving", rough=0.5, color=color) for color in (1.0, 0.0)]
    white, black = (np.asarray(one.eval(wo, wi, precision="float64"))[:, 0] for one in lobes)
    kept = (white - black) * np.pi / wi[:, 2]
    half = wo + wi
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    own, meant = (1.0 - (0.04 + 0.96 * (1.0 - c) ** 5) for c in (half[:, 2], np.sum(half * wo, axis=1)))
    figures = {
        "own_off": float(np.max(np.abs(kept - own))),
        "meant_off": float(np.max(np.abs(kept - meant))),
        "beside": float(kept[0]),
        "opposite": float(kept[1]),
        "beside_meant": float(meant[0]),
        "opposite_meant": float(meant[1]),
    }
    for name in ("standard", "conserving"):
        gloss, whole = (furnace(material(folder, f"babylon-{name}", rough=0.1, metal=0.0, color=color), (0.05,))[0]
                        for color in (0.0, 1.0))  # fmt: skip
        figures |= {"gloss": gloss, f"diffuse_{name}": whole - gloss}
    return figures


def _coat(folder: Path) -> dict[str, float]:
    """Albedos with and without a coat; ratio of a rough coat over white metal to the same coat over black metal."""
    bare = furnace(material(folder, "babylon-standard", rough=0.5, metal=0.0), (0.05,))[0]
    settings = {"rough": 0.5, "metal": 0.0, "coatRough": 0.1}
    whole = furnace(material(folder, "babylon-coat", **settings), (0.05,))[0]
    black = furnace(material(folder, "babylon-coat", color=0.0, **settings), (0.05,))[0]
    figures = {"coated": whole, "coated_black": black, "bare": bare}
    wo, wi = np.array([[0.0, 0.0, 1.0]]), np.array([[np.sqrt(0.5), 0.0, np.sqrt(0.5)]])
    over, above = (
        float(material(folder, "babylon-coat", rough=0.0, metal=1.0, coatRough=1.0, color=color).eval(wo, wi)[0, 0])
        for color in (1.0, 0.0)
    )
    energy = single_scattering(1.0, (1.0,))[0]
    return figures | {
        "coat_ratio": over / above,
        "coat_factor": 1.0 / energy,
        "coat_meant": 1 + 0.04 * (1 / energy - 1),
    }


def _smooth(folder: Path) -> dict[str, float]:
    """Center of the lobe at roughness 0 in float32, divided by its value in float64."""
    cosine = np.sqrt(0.5)
    wo, wi = (np.array([[sign * cosine, 0.0, cosine]]) for sign in (1.0, -1.0))
    mirror = material(folder, "babylon-standard", rough=0.0, metal=0.0)
    single, double = (float(mirror.eval(wo, wi, precision=bits)[0, 0]) for bits in ("float32", "float64"))
    return {"smooth": single / double}


def sections(figures: dict[str, dict[str, float]]) -> str:
    """Sections on the Fresnel factor of the diffuse lobe and the energy of the coat."""
    last = list(figures.values())[-1]
    return f"""## The diffuse lobe is reduced by F at n.h

With legacy conservation off, `lightFragment` multiplies `info.diffuse` by 1 minus `fresnelSchlickGGX(NdotH, ...)`,
whereas the specular lobe uses F at `preInfo.VdotH`. The angle of incidence on a facet is the angle between v and h.
The formula (1 - F) / pi, with F at n.h, reproduces the shader's diffuse lobe within {last["own_off"]:.0e} for 2,000
random pairs of directions; with F at v.h, the two differ by up to {last["meant_off"]:.2f}. The table gives the diffuse
lobe of a white dielectric at n.v 0.1, relative to a white Lambertian surface:

| light direction, n.l 0.1 | F at n.h (as implemented) | F at v.h |
|---|---|---|
| on the viewer's side | {last["beside"]:.3f} | {last["beside_meant"]:.3f} |
| opposite the viewer, where the specular lobe is strongest | {last["opposite"]:.3f} | {last["opposite_meant"]:.3f} |

The diffuse lobe is reduced least where the specular lobe reflects most. Remedy: use `preInfo.VdotH` instead of `NdotH`
in `lightFragment`, `pbrClusteredLightingFunctions` and `openpbrDirectLighting`, and in the WGSL chunks of the same
names. Alternatively, multiply by 1 minus the albedo of the specular lobe at n.v, as `pbrBlockFinalLitComponents` does
for `finalIrradiance`.

## The clear coat is compensated with the F0 of its base

`clearcoatBlock` passes `outParams.specularEnvironmentR0` to `getEnergyConservationFactor`. The compensation factor of
the coat is therefore 1 + F0 (1 / E - 1) with the F0 of the base, whereas the F0 of the coat is 0.04. Away from the
highlight of the base, a coat of roughness 1 over white metal is {last["coat_ratio"]:.2f} times as bright as the same
coat over black metal. This ratio is close to 1 / E, which is {last["coat_factor"]:.2f}; with F0 = 0.04, the factor
would be {last["coat_meant"]:.2f} over any base.
Remedy: pass `vec3(vClearCoatRefractionParams.x)` instead of `outParams.specularEnvironmentR0`."""


CAUSES = {
    (
        "babylon-standard",
        "reciprocity",
    ): "`getEnergyConservationFactor` depends only on n.v, which trades reciprocity for energy conservation. Without "
    "it (E = 1 in the table), the largest relative difference between f(wo, wi) and f(wi, wo) is {none_asymmetry:.0e} "
    "instead of {asymmetry:.2f}. Reciprocity matters to path tracers but not to rasterizers.",
    (
        "babylon-standard",
        "energy",
    ): "The albedo table is stored as an 8-bit RGBD image (the alpha channel is a common divisor of the colors). Its "
    "values of E have errors of up to {table:.1%} at roughness 0.25 and above. An error of this size is invisible.",
    (
        "babylon-standard",
        "precision",
    ): "At the center of the lobe, `NdotH^2 (a2 - 1) + 1` in `normalDistributionFunction_TrowbridgeReitzGGX` loses "
    "digits to cancellation. With a `MINIMUMVARIANCE` of 0.0005, a2 can be as small as 2.5e-7, which is only four "
    "times the rounding error of float32 near 1: at roughness 0 and an angle of 45 degrees, the center of the "
    "highlight is {smooth:.2f} times the exact value of the formula. Remedy: compute 1 - NdotH^2 as the squared length "
    "of cross(n, h), as in Filament.",
    (
        "babylon-standard(metal=0)",
        "energy",
    ): "The specular lobe is added to a white base that is attenuated too little; see the white-furnace results for "
    "the white dielectric.",
    ("babylon-standard(metal=0)", "reciprocity"): "same as for metal; the compensation factor is 1 + 0.04 (1 / E - 1).",
    ("babylon-standard(metal=0)", "precision"): "same as for metal.",
    (
        "babylon-conserving",
        "energy",
    ): "The specular lobe is added to a white base that is attenuated too little, because F is evaluated at n.h (see "
    "[above](#the-diffuse-lobe-is-reduced-by-f-at-nh)).",
    ("babylon-conserving", "reciprocity"): "same as for the standard material.",
    ("babylon-conserving", "precision"): "same as for the standard material.",
    ("babylon-conserving", "linearity"): "same as for the coat: the F0 of a partly metallic material enters squared.",
    ("babylon-coat", "reciprocity"): "same as for the standard material.",
    (
        "babylon-coat",
        "energy",
    ): "The specular lobe is added to a white base that is attenuated too little; see the white-furnace results for "
    "the clear coat.",
    (
        "babylon-coat",
        "pdf",
    ): "The engine provides no sampling density; the density tested here is that of Gonio's guide.",
    (
        "babylon-coat",
        "linearity",
    ): "`getR0RemappedForClearCoat` is a third-degree polynomial in the color of the base; in addition, F0 is "
    "multiplied by 1 + F0 (1 / E - 1). The nonlinearity is inherent in the model.",
    ("babylon-coat", "precision"): "same as for the standard material; the coat's lobe is affected, too.",
    ("babylon-sheen", "reciprocity"): "`sheenAlbedoScaling` and `getEnergyConservationFactor` depend only on n.v.",
    (
        "babylon-sheen",
        "energy",
    ): "The specular lobe is added to a white base that is attenuated too little. At grazing angles, the sheen adds "
    "further light: at sheen roughness 0.1 and n.v 0.05, the sheen lobe has an albedo of {sheen_10:.2f}, whereas the "
    "table from which the attenuation of the base is computed gives {sheen_taken_10:.2f}; at sheen roughness 0.25, the "
    "values are {sheen_25:.2f} and {sheen_taken_25:.2f}.",
    ("babylon-sheen", "precision"): "same as for the standard material.",
    ("babylon-anisotropic", "reciprocity"): "same as for the standard material.",
    (
        "babylon-anisotropic",
        "energy",
    ): "same as for the standard material; in addition, E is looked up at `roughness`, whereas the lobe is wider "
    "along the tangent.",
    ("babylon-anisotropic", "precision"): "same as for the standard material.",
}

ENGINE = Engine(
    package="@babylonjs/core",
    page="babylon",
    title="Babylon.js",
    home="https://github.com/BabylonJS/Babylon.js",
    intro=INTRO,
    materials=(
        "babylon-standard",
        "babylon-standard(metal=0)",
        "babylon-conserving",
        "babylon-coat",
        "babylon-sheen",
        "babylon-anisotropic",
    ),
    furnaces=(
        Furnace("White metal", "babylon-standard", lambda r: {"rough": r}),
        Furnace("White dielectric", "babylon-standard", lambda r: {"rough": r, "metal": 0.0}),
        Furnace("White dielectric, legacy conservation off", "babylon-conserving", lambda r: {"rough": r}),
        Furnace("White, half metal", "babylon-standard", lambda r: {"rough": r, "metal": 0.5}),
        Furnace("White metal, anisotropy 0.7", "babylon-anisotropic", lambda r: {"rough": r, "strength": 0.7}),
        Furnace(
            "White dielectric, clear coat of this roughness",
            "babylon-coat",
            lambda r: {"rough": 0.5, "coatRough": r},
            "White dielectric with a clear coat; roughness of the coat varies",
        ),
        Furnace(
            "White dielectric, white sheen of this roughness",
            "babylon-sheen",
            lambda r: {"rough": 0.5, "sheenRough": r},
            "White dielectric with white sheen; roughness of the sheen varies",
        ),
    ),
    remarks={
        "White dielectric": "By default, the diffuse lobe is scaled by 1 - 0.04 at all angles. At roughness 0.1 and "
        "n.v 0.05, the albedo of the specular lobe alone is {gloss:.2f}, and that of the diffuse lobe is still "
        "{diffuse_standard:.2f}.",
        "White dielectric, legacy conservation off": "At roughness 0.1 and n.v 0.05, the albedo of the diffuse lobe is "
        "still {diffuse_conserving:.2f}. The lobe is scaled by 1 - F, but with F at n.h instead of v.h: see "
        "[below](#the-diffuse-lobe-is-reduced-by-f-at-nh). For light from an environment map, the diffuse lobe is "
        "instead reduced by the albedo of the specular lobe.",
        "White, half metal": "The F0 of the dielectric and that of the metal are blended before the compensation "
        "factor, 1 + F0 (1 / E - 1), is applied, although this factor is meant for a single F0.",
        "White metal, anisotropy 0.7": "The engine looks up E in its albedo table at `roughness`, whereas the lobe is "
        "wider along the tangent.",
        "White dielectric, clear coat of this roughness": "At roughness 0.1 and n.v 0.05, the coat and the specular "
        "lobe over a black base have an albedo of {coated_black:.2f}. The white base, whose albedo without a coat is "
        "{bare:.2f}, is scaled by 1 - F(v.h) for each light. At grazing view angles, v.h is large and F(v.h) is small "
        "for most light directions, although the albedo of the coat is much larger than these values of F. At normal "
        "incidence, the coat scales the base by 0.96 and adds less light than it removes.",
        "White dielectric, white sheen of this roughness": "`sheen.albedoScaling` is on. For low sheen roughness, see "
        "*energy* below.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=("babylon-furnace.html",),
)
